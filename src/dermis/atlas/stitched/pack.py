"""Packing of pieces and their gutters into the square."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.gutter import Border, GutterWidth, Packing, find_border, needed
from dermis.atlas.stitched.surface import Doubles, Flags, FlatSurface, Index

_CELLS = 512  # along the square at most
_HALVINGS = 9  # in the search for the scale
_ATTEMPTS = 6  # by size, height, width; each by rows and by columns
_GAIN = 1.003  # of the scale, for another attempt to be worth a search


class _Piece(NamedTuple):
    """One piece by itself.

    part : its triangles, as a surface of their own
    uv : (t, 3, 2) corners, scaled, the least at 0
    most : (2,) greatest of all corners
    scale : of its uv
    per_mm : scaled uv in a mm of the surface
    border : its sides, by the triangles' number within the piece
    """

    part: FlatSurface
    uv: Doubles
    most: Doubles
    scale: float
    per_mm: float
    border: Border


class _Shape(NamedTuple):
    """Cells that a piece needs at some scale.

    spans : (m, 3) row, first and last column of runs of cells
    extent : columns and rows
    margin : (2,) from the first cell to where the piece's uv is 0 [cell]
    """

    spans: NDArray[np.int32]
    extent: tuple[int, int]
    margin: Doubles


def pack_pieces(
    surface: FlatSurface, piece: Index, scale: Doubles, size: int, width: GutterWidth
) -> Packing | None:
    """Pieces side by side with room for their gutters, as large as possible.

    None if they do not fit at any scale.

    piece : (f,) from 0, -1 for triangles without a place
    scale : (f,) of the uv of each triangle's piece, by which density is evened out
    size : of the map [texel]
    """
    cells = min(size, _CELLS)
    order = np.argsort(piece, kind="stable")[np.count_nonzero(piece < 0) :]
    groups = [own for own in np.split(order, np.flatnonzero(np.diff(piece[order])) + 1) if len(own)]
    pieces = [_apart(surface, piece, own, float(scale[own[0]])) for own in groups]
    packing = Packing(np.zeros(surface.uv.shape), *np.zeros((2, len(piece))))
    if not pieces:
        return packing
    best, corner = _search(pieces, cells, width._replace(widest=width.widest * cells / size))
    if corner is None:
        return None
    per_cell = size / cells
    for own, one, low in zip(groups, pieces, corner, strict=True):
        packing.places[own] = (one.uv * best + low) * per_cell - 0.5
        packing.per_uv[own] = one.scale * best * per_cell
        packing.per_mm[own] = one.per_mm * best * per_cell
    return packing


def _apart(surface: FlatSurface, piece: Index, own: Index, scale: float) -> _Piece:
    border = find_border(surface, piece, own)
    number = np.empty(len(piece), np.int64)
    number[own] = np.arange(len(own))
    border = border._replace(triangle=number[border.triangle])
    uv, part = surface.uv[own] * scale, surface.part(own)
    uv -= uv.min(axis=(0, 1))
    per_mm = scale * float(np.sqrt(np.abs(part.area_uv).sum() / part.area_mm2.sum()))
    return _Piece(part, uv, uv.max(axis=(0, 1)), scale, per_mm, border)


def _search(pieces: list[_Piece], cells: int, width: GutterWidth) -> tuple[float, list[Doubles] | None]:
    """Largest scale [cell per unit of scaled uv] at which all fit, and where each piece's uv is 0 [cell]."""
    area = sum(float(np.abs(one.part.area_uv).sum()) * one.scale**2 for one in pieces)
    best, corner = 0.0, None
    for attempt in range(_ATTEMPTS):
        if attempt > 0 and (corner is None or _pack(pieces, best * _GAIN, cells, width, attempt) is None):
            continue
        low, high = best, cells / np.sqrt(area)
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            found = _pack(pieces, middle, cells, width, attempt)
            if found is None:
                high = middle
            else:
                low, best, corner = middle, middle, found
    return best, corner


def _pack(
    pieces: list[_Piece], scale: float, cells: int, width: GutterWidth, attempt: int
) -> list[Doubles] | None:
    """Where each piece's uv is 0 [cell] when they are laid side by side; None if they do not fit.

    attempt : chooses which comes first, and whether by rows or by columns
    """
    from dermis.atlas.stitched.kernels.pack import pack

    if any((one.most * scale > cells).any() for one in pieces):
        return None
    shapes: list[_Shape] = []
    area: list[int] = []
    for one in pieces:
        shapes.append(_shape(one, scale, width, by_columns=attempt % 2 == 1))
        area.append(int((shapes[-1].spans[:, 2] - shapes[-1].spans[:, 1] + 1).sum()))
        if sum(area) > cells**2 or max(shapes[-1].extent) > cells:
            return None
    extent = np.array([shape.extent for shape in shapes], np.int32)
    order = np.argsort(-np.array((area, *extent.T))[attempt // 2], kind="stable")
    spans = np.concatenate([shape.spans for shape in shapes])
    first = np.cumsum([0, *(len(shape.spans) for shape in shapes)])
    corner = np.zeros((len(shapes), 2), np.int32)
    if not pack(spans, first, extent, order, cells, corner):
        return None
    if attempt % 2 == 1:
        corner = corner[:, ::-1]
    return [shape.margin + low for shape, low in zip(shapes, corner, strict=True)]


def _shape(one: _Piece, scale: float, width: GutterWidth, by_columns: bool) -> _Shape:
    """All cells in which a texel might be needed; `by_columns` swaps rows and columns."""
    margin = np.ceil(_half_extent(one, scale, width)) + 2
    across, down = np.ceil(one.most * scale + 2 * margin).astype(int) + 1
    every = np.ones(len(one.uv))
    places = one.uv * scale + margin - 0.5
    packing = Packing(places, every * one.scale * scale, every * one.per_mm * scale)
    mask = needed(one.part, np.arange(len(every)), one.border, packing, width, (int(down), int(across)))
    # a needed texel may lie in a cell whose centre is not needed
    mask[1:] |= mask[:-1].copy()
    mask[:-1] |= mask[1:].copy()
    mask[:, 1:] |= mask[:, :-1].copy()
    mask[:, :-1] |= mask[:, 1:].copy()
    y, x = np.nonzero(mask)
    low = np.array([x.min(), y.min()])
    mask = mask[low[1] : y.max() + 1, low[0] : x.max() + 1]
    spans, extent = _spans(mask.T if by_columns else mask)
    return _Shape(spans, extent, margin - low)


def _spans(mask: Flags) -> tuple[NDArray[np.int32], tuple[int, int]]:
    """Runs (m, 3) of true cells, long ones first, as they collide most often; columns and rows."""
    step = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, begin = np.nonzero(step > 0)
    end = np.nonzero(step < 0)[1] - 1
    spans = np.column_stack((row, begin, end))[np.argsort(begin - end, kind="stable")]
    return np.ascontiguousarray(spans, np.int32), (mask.shape[1], mask.shape[0])


def _half_extent(one: _Piece, scale: float, width: GutterWidth) -> Doubles:
    """(2,) how far gutters reach along u and v at most [cell]."""
    steps = one.part.along[one.border.triangle] / (one.scale * scale)
    if not len(steps):
        return np.ones(2)
    e, g = ((steps[..., k, :] ** 2).sum(axis=-1) for k in (0, 1))
    f = (steps[..., 0, :] * steps[..., 1, :]).sum(axis=-1)
    det = np.maximum(e * g - f * f, 1e-9 * e * g)
    half = width.reach_mm * np.sqrt(np.array([(g / det).max(), (e / det).max()]))
    return np.asarray(np.clip(half, 1.0, max(width.widest, 1.0)))
