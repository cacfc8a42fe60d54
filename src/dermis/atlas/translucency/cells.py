"""Coarse cells of an atlas as sources and receivers of the light through thin parts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import GUTTER_TEXELS, Atlas
from dermis.base.arrays import Floats, Index, Ints, Mask
from dermis.mesh.geometry import expand_runs

Words = NDArray[np.uint32]
TILE_CELLS = 4
"""Cells along each side of a tile."""

TILE_MARGIN_TEXELS = 0.7
"""Margin around a tile within which triangles are listed, as a tile shows more than it covers [texel]."""

_PAIR_RADIUS = 3.2  # largest distance of a pair, in standard deviations of the widest Gaussian
_CELL_SIZE = 0.36  # side of a cell in the same unit; light interpolated between cells is smooth
_MAX_SIGMA_MM = 10.0  # in wax, which spreads light farther, there would be too many pairs
_MAX_TEXELS = 1024  # texels examined along each side, if there are fewer cells
_SAME_POINT = 0.1  # texels within this distance of their point are not gutters [texel]


@dataclass(frozen=True, eq=False)
class Cells:
    """An atlas divided into side x side cells, numbered row by row, and the cells into tiles.

    The shape of the surface matters only for the size of the cells. Arrays that list items by tile have a
    second array `..._first`: the items of tile k start at `first[k]` and end at `first[k + 1]`.

    size : texels along each side of the atlas
    side : cells along each side of the atlas
    max_sigma_mm : standard deviation of the widest Gaussian
    cell_mm : median side of a cell on the surface
    stride : distance of the texels whose light a source averages [texel]
    receiver_mask : (side, side) cells that receive light: those with lit texels and their neighbours
    receivers, receiver_first : (m,) uint32 packed x and y of the receivers by tile
    receiver_points : (m, 2) uint32 triangle at the centre of each receiver, and packed weights
    sources, source_first : (n,) indices of the cells with lit texels by tile
    triangles, triangle_first : (k,) uint32 triangles by the tiles that they overlap
    gutter_copies, gutter_copy_first : (c, 2) uint32 packed x and y of gutter texels, and of the texels that
        they copy, by cell
    """

    size: int
    side: int
    max_sigma_mm: float
    cell_mm: float
    stride: int
    receiver_mask: Mask
    receivers: Words
    receiver_points: Words
    receiver_first: Index
    sources: Index
    source_first: Index
    triangle_first: Words
    triangles: Words
    gutter_copy_first: Index
    gutter_copies: Words

    @property
    def radius_mm(self) -> float:
        """Return the largest distance between the two cells of a translucent pair [mm]."""
        return _PAIR_RADIUS * self.max_sigma_mm

    @property
    def tiles_per_side(self) -> int:
        """Return the number of tiles along each side of the atlas."""
        return -(-self.side // TILE_CELLS)


def divide_into_cells(atlas: Atlas, max_sigma_mm: float, coarser: float = 1.0) -> Cells:
    """Divide an atlas into cells for the light that Gaussians spread through thin parts.

    max_sigma_mm : standard deviation of the widest Gaussian, clipped so that pairs are at most 32 mm apart
    coarser : factor of the usual cell size
    """
    sigma_mm, texel_mm = min(max_sigma_mm, _MAX_SIGMA_MM), _texel_mm(atlas)
    side = int(np.ceil(atlas.size * texel_mm / (_CELL_SIZE * sigma_mm * coarser)))
    side = min(max(side, 1), atlas.size)
    stride = max(1, atlas.size // max(_MAX_TEXELS, side))
    tiles = -(-side // TILE_CELLS)
    centre = _centre_texels(atlas.size, side)
    lit = _cells_with(atlas.lit[::stride, ::stride], atlas.size, side, stride)
    triangle = atlas.triangle[np.ix_(centre, centre)]
    receiver = _dilated(lit) & (triangle >= 0)
    weights = atlas.barycentric[np.ix_(centre, centre)][receiver]
    points = np.column_stack([triangle[receiver].astype(np.uint32), _pack(*weights.T)])
    order, first = _sort_by_tile(_tile_of(atlas, points, side, tiles), tiles)
    return Cells(
        atlas.size,
        side,
        sigma_mm,
        texel_mm * atlas.size / side,
        stride,
        receiver,
        _pack(*np.nonzero(receiver)[::-1])[order],
        points[order],
        first,
        *_source_cells(lit, tiles),
        *_tile_triangles(atlas, side, tiles),
        *_gutter_copies(atlas, side),
    )


def _texel_mm(atlas: Atlas) -> float:
    """Return the median side of a texel on the surface [mm]."""
    step = max(1, atlas.size // _MAX_TEXELS)
    lit, stretch = atlas.lit[::step, ::step], atlas.stretch[::step, ::step].astype(np.float32)
    density = stretch[..., 0][lit] * stretch[..., 1][lit]
    return float(1.0 / np.sqrt(np.median(density))) if len(density) else 1.0


def _centre_texels(size: int, side: int) -> Index:
    """Return the index of the texel at the centre of each cell along one axis (side,)."""
    return np.asarray(((np.arange(side) + 0.5) * size / side).astype(np.int64))


def _cells_with(texels: Mask, size: int, side: int, stride: int) -> Mask:
    """Return the (side, side) mask of cells with marked texels, of which every `stride`-th is given."""
    first = -(-np.arange(side) * size // (side * stride))
    rows = np.logical_or.reduceat(texels, first, axis=0)
    return np.asarray(np.logical_or.reduceat(rows, first, axis=1))


def _dilated(cells: Mask) -> Mask:
    """Return a mask of cells extended by the eight neighbours of each."""
    padded = np.pad(cells, 1)
    rows = padded[:-2] | padded[1:-1] | padded[2:]
    return np.asarray(rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:])


def _sort_by_tile(tile: NDArray[np.integer], tiles: int) -> tuple[Index, Index]:
    """Return the order of items by tile, and the start of each tile (t + 1,)."""
    order = np.argsort(tile, kind="stable")
    return order, np.concatenate([[0], np.cumsum(np.bincount(tile, minlength=tiles * tiles))])


def _source_cells(lit: Mask, tiles: int) -> tuple[Index, Index]:
    """Return the indices of the lit cells by tile, and the start of each tile."""
    y, x = np.nonzero(lit)
    order, first = _sort_by_tile((y // TILE_CELLS * tiles + x // TILE_CELLS).astype(np.int32), tiles)
    return (y * len(lit) + x)[order], first


def _tile_of(atlas: Atlas, points: Words, side: int, tiles: int) -> Ints:
    """Return the tile (m,) of points on triangles, for gutter texels that of the point which they copy."""
    uv = np.stack(_atlas_uv(atlas, points[:, 0], points[:, 1]))
    column, row = np.clip(uv * np.float32(side), 0, side - 1).astype(np.int32) // TILE_CELLS
    return np.asarray(row * tiles + column, np.int32)


def _pack(low: NDArray[np.integer], high: NDArray[np.integer]) -> Words:
    """Return two 16-bit integers packed into each word."""
    return np.asarray(low.astype(np.uint32) | (high.astype(np.uint32) << 16), np.uint32)


def _tile_triangles(atlas: Atlas, side: int, tiles: int) -> tuple[Words, Words]:
    """Return the start of each tile, and the triangles whose bounding boxes overlap it."""
    index = np.flatnonzero(atlas.mapped)
    uv, margin = atlas.corner_uv[index].astype(np.float64), TILE_MARGIN_TEXELS / atlas.size
    low, high = uv.min(axis=1) - margin, uv.max(axis=1) + margin
    first, last = (np.clip((uv * side).astype(np.int64) // TILE_CELLS, 0, tiles - 1) for uv in (low, high))
    width, height = (last - first + 1).T
    which, number = expand_runs(np.zeros_like(width), width * height)
    x, y = first[which].T + np.stack([number % width[which], number // width[which]])
    order, begin = _sort_by_tile(y * tiles + x, tiles)
    return begin.astype(np.uint32), index[which[order]].astype(np.uint32)


def _gutter_copies(atlas: Atlas, side: int) -> tuple[Index, Words]:
    """Return the start of each cell, and its gutter texels with the texels that they copy."""
    rim, uv = _rim_texels(atlas)
    texel = np.concatenate([atlas.gutter, rim])
    x, y = np.clip(np.rint(np.concatenate([atlas.source, uv])), 0, atlas.size - 1).astype(np.int64).T
    cell = y * side // atlas.size * side + x * side // atlas.size
    order = np.argsort(cell, kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=side * side))])
    return first, np.column_stack([_pack(*texel[order].T), _pack(x[order], y[order])])


def _rim_texels(atlas: Atlas) -> tuple[NDArray[np.uint16], Floats]:
    """Return lit texels (r, 2) at the rim of charts that show points elsewhere, and these points [texel]."""
    inner, view = np.pad(atlas.lit, GUTTER_TEXELS), np.lib.stride_tricks.sliding_window_view
    for axis in (0, 1):
        inner = np.logical_and.reduce(view(inner, 2 * GUTTER_TEXELS + 1, axis), -1)
    y, x = np.nonzero(atlas.lit & ~inner)
    texel, weights = np.stack([x, y], axis=-1), _pack(*atlas.barycentric[y, x].T)
    uv = np.stack(_atlas_uv(atlas, atlas.triangle[y, x], weights), axis=-1)
    uv = uv * np.float32(atlas.size) - np.float32(0.5)
    elsewhere = np.abs(uv - texel).max(axis=1, initial=0.0) > _SAME_POINT
    return texel[elsewhere].astype(np.uint16), uv[elsewhere]


def _atlas_uv(atlas: Atlas, triangle: NDArray[np.integer], weights: Words) -> list[Floats]:
    """Return u and v in the atlas of points on triangles, v down.

    weights : packed weights of the second and third corner
    """
    corner = atlas.corner_uv[triangle].reshape(-1, 6)
    b, c = (part.astype(np.float32) / np.float32(65535) for part in (weights & 0xFFFF, weights >> 16))
    axes = (corner[:, axis::2].T for axis in range(2))
    return [first + b * (second - first) + c * (third - first) for first, second, third in axes]
