"""Packing of charts with their gutters into a square."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from dermis.atlas.stitched.gutter import Border, GutterWidth, Packing, find_border, needed_texels
from dermis.atlas.stitched.surface import Doubles, Flags, FlatSurface, Index

Span = tuple[int, int, int]
"""Row, first and last column of a run of cells."""
_CELLS = 512  # along the square at most
_COARSE = 4  # of them in one of those with which the best order is looked for, along each axis
_HALVINGS = 8  # in the search for the scale
_FINE_HALVINGS, _MORE = 4, 1.12  # in that with all cells, in which at most so much more is found
_ORDERS = 6  # by size, height, width; each by rows and by columns
_GAIN = 1.003  # least gain of the scale for which an order is searched
_MASKS = 4  # times at most that masks are made
_CLOSE = 0.65  # share of the scale of masks below which they are made again,
_ABOVE = 1.15  # so much above the one that was found


def place_shapes(shapes: Sequence[Sequence[Span]], n: int) -> list[tuple[int, int]] | None:
    """Column and row of shapes in n x n cells, each at the first free place by rows; None if one has none.

    shapes : runs of each, from row and column 0
    """
    taken, corners = 0, []
    for spans in shapes:
        free = _free(taken, spans, n)
        if not free:
            return None
        place = (free & -free).bit_length() - 1
        cells = 0
        for row, first, last in spans:
            cells |= ((2 << last - first) - 1) << row * n + first
        taken |= cells << place
        corners.append((place % n, place // n))
    return corners


def _free(taken: int, spans: Sequence[Span], n: int) -> int:
    """Cells at which the upper left one of a shape may come to lie."""
    height = 1 + max(row for row, _, _ in spans)
    width = 1 + max(last for _, _, last in spans)
    if max(height, width) > n:
        return 0
    blocked, ahead = 0, [taken]  # cells from which one of the next 1, 2, 4, ... is taken
    for row, first, last in spans:
        length = last - first + 1
        step = length.bit_length() - 1
        while len(ahead) <= step:
            ahead.append(ahead[-1] | ahead[-1] >> (1 << len(ahead) - 1))
        blocked |= (ahead[step] | ahead[step] >> length - (1 << step)) >> row * n + first
    rows = _every_row(n) & ((1 << n * (n - height + 1)) - 1)
    return rows * ((2 << n - width) - 1) & ~blocked


@cache
def _every_row(n: int) -> int:
    """The first cell of each row."""
    return ((1 << n * n) - 1) // ((1 << n) - 1)


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


class _Mask(NamedTuple):
    """Cells that a piece needs, whatever its scale.

    spans : (m, 3) row, first and last column of runs of cells
    margin : (2,) from the first cell to where the piece's uv is 0 [cell]
    scale : [cell per unit of scaled uv]
    """

    spans: Index
    margin: Doubles
    scale: float


class _Layout(NamedTuple):
    """Where pieces fit.

    scale : cells of the square in a unit of scaled uv
    corners : (p, 2) where each piece's uv is 0 [cell]
    """

    scale: float
    corners: Doubles


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
    found = _search(pieces, cells, width._replace(max_texels=width.max_texels * cells / size))
    if found is None:
        return None
    per_cell = size / cells
    for own, one, low in zip(groups, pieces, found.corners, strict=True):
        packing.corners[own] = (one.uv * found.scale + low) * per_cell - 0.5
        packing.texels_per_uv[own] = one.scale * found.scale * per_cell
        packing.per_mm[own] = one.per_mm * found.scale * per_cell
    return packing


def _apart(surface: FlatSurface, piece: Index, own: Index, scale: float) -> _Piece:
    border = find_border(surface, piece, own)
    number = np.empty(len(piece), np.int64)
    number[own] = np.arange(len(own))
    border = border._replace(triangle=number[border.triangle])
    uv, part = surface.uv[own] * scale, surface.subset(own)
    uv -= uv.min(axis=(0, 1))
    per_mm = scale * float(np.sqrt(np.abs(part.area_uv).sum() / part.area_mm2.sum()))
    return _Piece(part, uv, uv.max(axis=(0, 1)), scale, per_mm, border)


def _search(pieces: list[_Piece], cells: int, width: GutterWidth) -> _Layout | None:
    """The layout of the largest scale that is found."""
    area = sum(float(np.abs(one.part.area_uv).sum()) * one.scale**2 for one in pieces)
    top = cells / float(np.sqrt(area))
    for _ in range(_MASKS):
        found = _largest([_mask(one, top, width) for one in pieces], cells, top)
        if found is None or found.scale > _CLOSE * top:
            return found
        top = _ABOVE * found.scale
    return None


def _largest(masks: list[_Mask], cells: int, top: float) -> _Layout | None:
    """The largest scale below `top` that fits, in the order that is best with coarse cells."""
    coarse, best = None, 0
    for order in range(_ORDERS):
        least = coarse.scale if coarse else 0.0
        if order == 0 or (coarse and _pack(masks, least * _GAIN, cells // _COARSE, order)):
            found = _bisect(masks, (least, top / _COARSE), cells // _COARSE, order, _HALVINGS)
            coarse, best = (found, order) if found else (coarse, best)
    if coarse is None:
        return _bisect(masks, (0.0, top), cells, 0, _HALVINGS)
    same = _Layout(_COARSE * coarse.scale, _COARSE * coarse.corners)
    return _bisect(masks, (same.scale, same.scale * _MORE), cells, best, _FINE_HALVINGS) or same


def _bisect(
    masks: list[_Mask], bounds: tuple[float, float], cells: int, order: int, halvings: int
) -> _Layout | None:
    """The layout of the largest scale between two bounds that is found, None for none."""
    (low, high), best = bounds, None
    for _ in range(halvings):
        middle = (low + high) / 2
        found = _pack(masks, middle, cells, order)
        if found is None:
            high = middle
        else:
            low, best = middle, found
    return best


def _pack(masks: list[_Mask], scale: float, cells: int, order: int) -> _Layout | None:
    """Pieces side by side at a scale [cell per unit of scaled uv], None if they do not fit.

    order : chooses which comes first, and whether by rows or by columns
    """
    shapes, low = zip(*(_scaled(one, scale / one.scale) for one in masks), strict=True)
    if order % 2 == 1:
        shapes = tuple(shape.T for shape in shapes)
    size = [(np.count_nonzero(shape), *shape.shape) for shape in shapes]
    if sum(area for area, _, _ in size) > cells**2:
        return None
    first = np.argsort([-one[order // 2] for one in size], kind="stable")
    found = place_shapes([_spans(shapes[k]).tolist() for k in first], cells)
    if found is None:
        return None
    corners = np.empty((len(masks), 2))
    corners[first] = np.array(found)[:, ::-1] if order % 2 == 1 else found
    return _Layout(scale, corners + low)


def _scaled(mask: _Mask, scale: float) -> tuple[Flags, Doubles]:
    """(h, w) all cells that a mask touches at another scale, and its margin there."""
    row, first, last = (mask.spans.T - mask.margin[[1, 0, 0], None]) * scale
    top, bottom = np.floor(row).astype(int), np.ceil(row + scale).astype(int) - 1
    left, right = np.floor(first).astype(int), np.ceil(last + scale).astype(int) - 1
    low = np.array([left.min(), top.min()])
    height, width = bottom.max() - low[1] + 1, right.max() - low[0] + 1
    steps = np.zeros((height, width + 1), np.int32)
    for rows in (top, bottom):
        np.add.at(steps, (rows - low[1], left - low[0]), 1)
        np.add.at(steps, (rows - low[1], right - low[0] + 1), -1)
    return np.cumsum(steps, axis=1)[:, :-1] > 0, -low.astype(np.float64)


def _mask(one: _Piece, scale: float, width: GutterWidth) -> _Mask:
    """All cells in which a texel might be needed."""
    margin = np.ceil(_half_extent(one, scale, width)) + 2
    across, down = np.ceil(one.most * scale + 2 * margin).astype(int) + 1
    every = np.ones(len(one.uv))
    places = one.uv * scale + margin - 0.5
    packing = Packing(places, every * one.scale * scale, every * one.per_mm * scale)
    mask = needed_texels(one.part, np.arange(len(every)), one.border, packing, width, (int(down), int(across)))
    # a needed texel may lie in a cell whose centre is not needed
    mask[1:] |= mask[:-1].copy()
    mask[:-1] |= mask[1:].copy()
    mask[:, 1:] |= mask[:, :-1].copy()
    mask[:, :-1] |= mask[:, 1:].copy()
    return _Mask(_spans(mask), margin, scale)


def _spans(mask: Flags) -> Index:
    """(m, 3) row, first and last column of runs of true cells."""
    step = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, begin = np.nonzero(step > 0)
    return np.column_stack((row, begin, np.nonzero(step < 0)[1] - 1))


def _half_extent(one: _Piece, scale: float, width: GutterWidth) -> Doubles:
    """(2,) how far gutters reach along u and v at most [cell]."""
    steps = one.part.uv_steps[one.border.triangle] / (one.scale * scale)
    if not len(steps):
        return np.ones(2)
    e, g = ((steps[..., k, :] ** 2).sum(axis=-1) for k in (0, 1))
    f = (steps[..., 0, :] * steps[..., 1, :]).sum(axis=-1)
    det = np.maximum(e * g - f * f, 1e-9 * e * g)
    half = width.gutter_mm * np.sqrt(np.array([(g / det).max(), (e / det).max()]))
    return np.asarray(np.clip(half, 1.0, max(width.max_texels, 1.0)))
