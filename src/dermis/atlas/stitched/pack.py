"""Packing of chart pieces with their gutters into a square map."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from dermis.atlas.stitched.gutter import Border, GutterWidth, Packing, find_border, needed_texels
from dermis.atlas.stitched.surface import FlatSurface
from dermis.base.arrays import Doubles, Index, Mask

CellRun = tuple[int, int, int]
"""Run of cells in a row: row, first and last column."""
MAX_CELLS_PER_SIDE = 512
"""Largest number of cells along each side of the square; layouts of larger maps are the same."""
_COARSE_CELL_SIDE = 4  # side of a coarse cell, with which the best order is searched [cell]
_BISECTION_COUNT = 8  # number of trials in the search for the scale
_FINE_BISECTION_COUNT, _MAX_FINE_SCALE_GAIN = (
    4,
    1.12,
)  # trials with fine cells, and the largest factor of scale to gain
_PACKING_ORDER_COUNT = 6  # number of packing orders: by area, height and width, each by rows and by columns
_MIN_SCALE_GAIN = 1.003  # gain of scale for which the search is repeated with another order
_MAX_MASK_ATTEMPTS = 4  # number of attempts with masks of different scales
_MIN_SCALE_RATIO_TO_KEEP_MASKS = (
    0.65  # masks are computed again if the ratio of the found scale to their scale is smaller
)
_NEXT_MASK_SCALE_RATIO = 1.15  # ratio of the scale of the next masks to the found scale


def place_shapes(shapes: Sequence[Sequence[CellRun]], cells_per_side: int) -> list[tuple[int, int]] | None:
    """Return the column and row at which each shape is placed on n x n cells, or None if not all shapes fit.

    Each shape is placed at the first free position, searched row by row.

    shapes : cells of each shape as runs (row, first and last column), counted from row and column 0
    cells_per_side : number n of cells along each side of the grid
    """
    occupied, corners = 0, []
    for spans in shapes:
        free = _free_positions(occupied, spans, cells_per_side)
        if not free:
            return None
        position = (free & -free).bit_length() - 1
        cells = 0
        for row, first, last in spans:
            cells |= ((2 << last - first) - 1) << row * cells_per_side + first
        occupied |= cells << position
        corners.append((position % cells_per_side, position // cells_per_side))
    return corners


def _free_positions(occupied_cells: int, shape_runs: Sequence[CellRun], cells_per_side: int) -> int:
    """Return the free positions for the upper left cell of a shape, as a bit mask of n x n cells.

    occupied_cells : bit mask of the occupied cells
    shape_runs : cells of the shape as runs, see `place_shapes`
    cells_per_side : number n of cells along each side of the grid
    """
    height = 1 + max(row for row, _, _ in shape_runs)
    width = 1 + max(last for _, _, last in shape_runs)
    if max(height, width) > cells_per_side:
        return 0
    blocked, ahead = (
        0,
        [occupied_cells],
    )  # ahead: cells from which one of the next 1, 2, 4, ... cells is occupied
    for row, first, last in shape_runs:
        length = last - first + 1
        step = length.bit_length() - 1
        while len(ahead) <= step:
            ahead.append(ahead[-1] | ahead[-1] >> (1 << len(ahead) - 1))
        blocked |= (ahead[step] | ahead[step] >> length - (1 << step)) >> row * cells_per_side + first
    rows = _row_start_mask(cells_per_side) & ((1 << cells_per_side * (cells_per_side - height + 1)) - 1)
    return rows * ((2 << cells_per_side - width) - 1) & ~blocked


@cache
def _row_start_mask(cells_per_side: int) -> int:
    """Return a bit mask of n x n cells in which the first cell of each row is set."""
    return ((1 << cells_per_side * cells_per_side) - 1) // ((1 << cells_per_side) - 1)


class _Piece(NamedTuple):
    """Chart, or part of a chart, prepared for packing.

    surface : triangles of the piece
    uv : (t, 3, 2) uv of the corners: the mesh's uv multiplied by `scale`, and moved so that the lowest
        coordinates are 0
    extent : (2,) largest u and v in `uv`
    scale : factor from the mesh's uv to `uv`
    uv_per_mm : length in `uv` per mm on the surface, averaged over the piece [1/mm]
    border : border of the piece, with triangle indices within the piece
    """

    surface: FlatSurface
    uv: Doubles
    extent: Doubles
    scale: float
    uv_per_mm: float
    border: Border


class _PieceMask(NamedTuple):
    """Grid cells that a chart piece with its gutter occupies at one scale.

    spans : (m, 3) row, first and last column of each run of cells
    margin : (2,) distance from the first column and row to the origin of the piece's uv [cell]
    scale : number of cells per unit of `_Piece.uv`
    """

    spans: Index
    margin: Doubles
    scale: float


class PieceLayout(NamedTuple):
    """Positions of packed chart pieces on a square grid of cells.

    The grid has one cell per texel of the map, but at most 512 x 512 cells.

    scale : number of cells per unit of `_Piece.uv`, the same for all pieces
    origins : (p, 2) position of the origin of each piece's uv [cell]
    """

    scale: float
    origins: Doubles


def pack_pieces(
    surface: FlatSurface,
    triangle_piece: Index,
    uv_scale: Doubles,
    map_side: int,
    gutter_width: GutterWidth,
    layout: PieceLayout | None = None,
) -> Packing | None:
    """Pack chart pieces with their gutters at the largest common scale; return None if they do not fit.

    triangle_piece : (f,) index of each triangle's piece from 0, -1 for triangles in no piece
    uv_scale : (f,) factor by which each triangle's uv is scaled so that all pieces have a similar texel
        density
    map_side : texels along each side of the map
    gutter_width : width of the gutters
    layout : result of `find_piece_layout`, if it is known; None to search for a layout, which is slow
    """
    groups, pieces = _prepare_pieces(surface, triangle_piece, uv_scale)
    packing = Packing(np.zeros(surface.uv.shape), *np.zeros((2, len(triangle_piece))))
    if not pieces:
        return packing
    found = layout or _search_piece_layout(pieces, map_side, gutter_width)
    if found is None:
        return None
    per_cell = map_side / min(map_side, MAX_CELLS_PER_SIDE)
    for members, one, low in zip(groups, pieces, found.origins, strict=True):
        packing.corners[members] = (one.uv * found.scale + low) * per_cell - 0.5
        packing.texels_per_uv[members] = one.scale * found.scale * per_cell
        packing.texels_per_mm[members] = one.uv_per_mm * found.scale * per_cell
    return packing


def find_piece_layout(
    surface: FlatSurface, triangle_piece: Index, uv_scale: Doubles, map_side: int, gutter_width: GutterWidth
) -> PieceLayout | None:
    """Search for a layout of chart pieces, to be passed to `pack_pieces`; return None if they do not fit.

    triangle_piece, uv_scale, map_side : as for `pack_pieces`
    gutter_width : width of the gutters
    """
    return _search_piece_layout(_prepare_pieces(surface, triangle_piece, uv_scale)[1], map_side, gutter_width)


def _prepare_pieces(
    surface: FlatSurface, triangle_piece: Index, uv_scale: Doubles
) -> tuple[list[Index], list[_Piece]]:
    """Return the triangle indices of each chart piece, and the pieces prepared for packing.

    triangle_piece, uv_scale : as for `pack_pieces`
    """
    order = np.argsort(triangle_piece, kind="stable")[np.count_nonzero(triangle_piece < 0) :]
    groups = [
        members
        for members in np.split(order, np.flatnonzero(np.diff(triangle_piece[order])) + 1)
        if len(members)
    ]
    return groups, [
        _prepare_piece(surface, triangle_piece, members, float(uv_scale[members[0]])) for members in groups
    ]


def _prepare_piece(
    surface: FlatSurface, triangle_piece: Index, member_triangles: Index, uv_scale: float
) -> _Piece:
    border = find_border(surface, triangle_piece, member_triangles)
    index_in_piece = np.empty(len(triangle_piece), np.int64)
    index_in_piece[member_triangles] = np.arange(len(member_triangles))
    border = border._replace(triangle=index_in_piece[border.triangle])
    uv, subset = surface.uv[member_triangles] * uv_scale, surface.subset(member_triangles)
    uv -= uv.min(axis=(0, 1))
    uv_per_mm = uv_scale * float(np.sqrt(np.abs(subset.uv_area).sum() / subset.area_mm2.sum()))
    return _Piece(subset, uv, uv.max(axis=(0, 1)), uv_scale, uv_per_mm, border)


def _search_piece_layout(
    pieces: list[_Piece], map_side: int, gutter_width: GutterWidth
) -> PieceLayout | None:
    """Return the layout with the largest scale that the search finds, or None if no scale fits.

    pieces : pieces prepared for packing
    map_side : texels along each side of the map
    gutter_width : width of the gutters
    """
    cells = min(map_side, MAX_CELLS_PER_SIDE)
    gutter_width = gutter_width._replace(max_texels=gutter_width.max_texels * cells / map_side)
    area = sum(float(np.abs(one.surface.uv_area).sum()) * one.scale**2 for one in pieces)
    top = cells / float(np.sqrt(area))
    for _ in range(_MAX_MASK_ATTEMPTS):
        found = _find_largest_scale([_piece_mask(one, top, gutter_width) for one in pieces], cells, top)
        if found is None or found.scale > _MIN_SCALE_RATIO_TO_KEEP_MASKS * top:
            return found
        top = _NEXT_MASK_SCALE_RATIO * found.scale
    return None


def _find_largest_scale(masks: list[_PieceMask], cells_per_side: int, max_scale: float) -> PieceLayout | None:
    """Return the layout with the largest scale up to a maximum, or None if no scale fits.

    Several packing orders are compared with coarse cells; only the best order is tried with fine cells.

    masks : cells that each piece occupies
    cells_per_side : cells along each side of the grid
    max_scale : largest scale to try, in cells per unit of `_Piece.uv`
    """
    coarse, best = None, 0
    for order in range(_PACKING_ORDER_COUNT):
        lower = coarse.scale if coarse else 0.0
        if order == 0 or (
            coarse
            and _layout_at_scale(masks, lower * _MIN_SCALE_GAIN, cells_per_side // _COARSE_CELL_SIDE, order)
        ):
            found = _bisect_scale(
                masks,
                (lower, max_scale / _COARSE_CELL_SIDE),
                cells_per_side // _COARSE_CELL_SIDE,
                order,
                _BISECTION_COUNT,
            )
            coarse, best = (found, order) if found else (coarse, best)
    if coarse is None:
        return _bisect_scale(masks, (0.0, max_scale), cells_per_side, 0, _BISECTION_COUNT)
    same = PieceLayout(_COARSE_CELL_SIDE * coarse.scale, _COARSE_CELL_SIDE * coarse.origins)
    return (
        _bisect_scale(
            masks,
            (same.scale, same.scale * _MAX_FINE_SCALE_GAIN),
            cells_per_side,
            best,
            _FINE_BISECTION_COUNT,
        )
        or same
    )


def _bisect_scale(
    masks: list[_PieceMask],
    scale_bounds: tuple[float, float],
    cells_per_side: int,
    order_index: int,
    bisection_count: int,
) -> PieceLayout | None:
    """Return the layout with the largest scale that bisection finds, or None if no trial fits.

    masks : cells that each piece occupies
    scale_bounds : lowest and highest scale
    cells_per_side : cells along each side of the grid
    order_index : index of the packing order, see `_layout_at_scale`
    bisection_count : number of trials
    """
    (low, high), best = scale_bounds, None
    for _ in range(bisection_count):
        middle = (low + high) / 2
        found = _layout_at_scale(masks, middle, cells_per_side, order_index)
        if found is None:
            high = middle
        else:
            low, best = middle, found
    return best


def _layout_at_scale(
    masks: list[_PieceMask], scale: float, cells_per_side: int, order_index: int
) -> PieceLayout | None:
    """Return the layout of the pieces at one scale, or None if they do not fit.

    masks : cells that each piece occupies
    scale : number of cells per unit of `_Piece.uv`, the same for all pieces
    cells_per_side : cells along each side of the grid
    order_index : index of the packing order: order_index // 2 selects the sort key (0 area, 1 height, 2
        width); if the index is odd, pieces are placed column by column instead of row by row
    """
    shapes, low = zip(*(_scaled_mask(one, scale / one.scale) for one in masks), strict=True)
    if order_index % 2 == 1:
        shapes = tuple(shape.T for shape in shapes)
    size = [(np.count_nonzero(shape), *shape.shape) for shape in shapes]
    if sum(area for area, _, _ in size) > cells_per_side**2:
        return None
    first = np.argsort([-one[order_index // 2] for one in size], kind="stable")
    found = place_shapes([_cell_runs(shapes[k]).tolist() for k in first], cells_per_side)
    if found is None:
        return None
    corners = np.empty((len(masks), 2))
    corners[first] = np.array(found)[:, ::-1] if order_index % 2 == 1 else found
    return PieceLayout(scale, corners + low)


def _scaled_mask(piece_mask: _PieceMask, scale: float) -> tuple[Mask, Doubles]:
    """Return the mask (h, w) of all cells that a scaled chart piece touches, and its scaled margin (2,).

    scale : factor from the scale of `piece_mask` to the new scale
    """
    row, first, last = (piece_mask.spans.T - piece_mask.margin[[1, 0, 0], None]) * scale
    top, bottom = np.floor(row).astype(int), np.ceil(row + scale).astype(int) - 1
    left, right = np.floor(first).astype(int), np.ceil(last + scale).astype(int) - 1
    low = np.array([left.min(), top.min()])
    height, width = bottom.max() - low[1] + 1, right.max() - low[0] + 1
    steps = np.zeros((height, width + 1), np.int32)
    for rows in (top, bottom):
        np.add.at(steps, (rows - low[1], left - low[0]), 1)
        np.add.at(steps, (rows - low[1], right - low[0] + 1), -1)
    return np.cumsum(steps, axis=1)[:, :-1] > 0, -low.astype(np.float64)


def _piece_mask(piece: _Piece, scale: float, gutter_width: GutterWidth) -> _PieceMask:
    """Return the grid cells that a chart piece and its gutter occupy, including partly occupied cells.

    scale : number of cells per unit of `_Piece.uv`
    """
    margin = np.ceil(_gutter_extent(piece, scale, gutter_width)) + 2
    columns, rows = np.ceil(piece.extent * scale + 2 * margin).astype(int) + 1
    ones = np.ones(len(piece.uv))
    corners = piece.uv * scale + margin - 0.5
    packing = Packing(corners, ones * piece.scale * scale, ones * piece.uv_per_mm * scale)
    mask = needed_texels(
        piece.surface, np.arange(len(ones)), piece.border, packing, gutter_width, (int(rows), int(columns))
    )
    # a cell may contain a needed texel although its centre is not needed
    mask[1:] |= mask[:-1].copy()
    mask[:-1] |= mask[1:].copy()
    mask[:, 1:] |= mask[:, :-1].copy()
    mask[:, :-1] |= mask[:, 1:].copy()
    return _PieceMask(_cell_runs(mask), margin, scale)


def _cell_runs(cell_mask: Mask) -> Index:
    """Return the runs of true cells of a mask, (m, 3): row, first and last column."""
    step = np.diff(np.pad(cell_mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, begin = np.nonzero(step > 0)
    return np.column_stack((row, begin, np.nonzero(step < 0)[1] - 1))


def _gutter_extent(piece: _Piece, scale: float, gutter_width: GutterWidth) -> Doubles:
    """Return the largest width (2,) of a piece's gutters along u and v [cell]."""
    steps = piece.surface.uv_tangents[piece.border.triangle] / (piece.scale * scale)
    if not len(steps):
        return np.ones(2)
    e, g = ((steps[..., k, :] ** 2).sum(axis=-1) for k in (0, 1))
    f = (steps[..., 0, :] * steps[..., 1, :]).sum(axis=-1)
    det = np.maximum(e * g - f * f, 1e-9 * e * g)
    half = gutter_width.gutter_mm * np.sqrt(np.array([(g / det).max(), (e / det).max()]))
    return np.asarray(np.clip(half, 1.0, max(gutter_width.max_texels, 1.0)))
