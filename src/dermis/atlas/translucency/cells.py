"""Division of an atlas into coarse cells, which are grouped into tiles, to compute translucency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import GUTTER_TEXELS, Atlas
from dermis.base.arrays import Floats, Index, Ints, Mask
from dermis.mesh.geometry import expand_runs

Words = NDArray[np.uint32]
CELLS_PER_TILE_SIDE = 4
"""Number of cells along each side of a tile."""

TILE_MARGIN_TEXELS = 0.7
"""Margin around a tile [texel].

Triangles in the margin count as overlapping the tile, because interpolation reads beyond the tile.
"""

# In standard deviations of the widest Gaussian: largest distance between an entry and an exit cell; and side
# of a cell, so small that light interpolated between cells is smooth.
_PAIR_RADIUS_SIGMAS, _CELL_SIDE_SIGMAS = 3.2, 0.36
_MAX_SIGMA_MM = 10.0  # limit for materials such as wax, in which there would be too many pairs of cells
_MAX_AVERAGED_TEXELS_PER_SIDE = (
    1024  # texels per side whose light is averaged into cells; more if there are more cells
)
_SAME_POINT_TEXELS = 0.1  # largest distance in the atlas at which a texel and a surface point count as equal


@dataclass(frozen=True, eq=False)
class Cells:
    """Division of an atlas into side x side cells, which are grouped into tiles, to compute translucency.

    Translucency is light that enters the skin in one cell and leaves it in another, for example on the other
    side of an ear.

    Cells are numbered row by row. An array that is sorted by tile or by cell comes with an array
    `..._first`: the entries of tile or cell k start at index `..._first[k]` and end before index
    `..._first[k + 1]`.

    size : texels along each side of the atlas
    side : cells along each side of the atlas
    max_sigma_mm : standard deviation of the widest Gaussian of the diffusion profiles [mm]
    cell_mm : median side of a cell on the surface [mm]
    stride : a source cell averages the light of every `stride`-th texel along each axis [texel]
    receiver_mask : (side, side) mask of the cells that receive light: cells with texels of `Atlas.lit_mask`,
        and their neighbours
    receivers, receiver_first : (m,) uint32 packed x and y of the receiving cells, sorted by tile
    receiver_points : (m, 2) uint32 surface point at the centre of each receiving cell: triangle index, and
        packed barycentric weights
    sources, source_first : (n,) indices of the cells with texels of `Atlas.lit_mask`, sorted by tile
    triangles, triangle_first : (k,) uint32 indices of the triangles that overlap each tile
    gutter_copies, gutter_copy_first : (c, 2) uint32 packed x and y of a gutter texel, and of the texel that
        it copies, sorted by cell
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
        """Return the largest distance between a cell where light enters and the cell where it leaves [mm]."""
        return _PAIR_RADIUS_SIGMAS * self.max_sigma_mm

    @property
    def tiles_per_side(self) -> int:
        """Return the number of tiles along each side of the atlas."""
        return -(-self.side // CELLS_PER_TILE_SIDE)


def divide_into_cells(atlas: Atlas, max_sigma_mm: float, relative_cell_size: float = 1.0) -> Cells:
    """Divide an atlas into cells for translucency, see `Cells`.

    max_sigma_mm : standard deviation of the widest Gaussian of the diffusion profiles; 10 mm is used for
        larger values [mm]
    relative_cell_size : cell size relative to the default [-]
    """
    sigma_mm, texel_mm = min(max_sigma_mm, _MAX_SIGMA_MM), _median_texel_mm(atlas)
    side = int(np.ceil(atlas.size * texel_mm / (_CELL_SIDE_SIGMAS * sigma_mm * relative_cell_size)))
    side = min(max(side, 1), atlas.size)
    stride = max(1, atlas.size // max(_MAX_AVERAGED_TEXELS_PER_SIDE, side))
    tiles = -(-side // CELLS_PER_TILE_SIDE)
    centre = _centre_texels(atlas.size, side)
    lit = _cells_with_marked_texels(atlas.lit_mask[::stride, ::stride], atlas.size, side, stride)
    triangle = atlas.triangle[np.ix_(centre, centre)]
    receiver = _dilate_cells(lit) & (triangle >= 0)
    weights = atlas.barycentric[np.ix_(centre, centre)][receiver]
    points = np.column_stack([triangle[receiver].astype(np.uint32), _pack_words(*weights.T)])
    order, first = _sort_by_tile(_tiles_of_points(atlas, points, side, tiles), tiles)
    return Cells(
        atlas.size,
        side,
        sigma_mm,
        texel_mm * atlas.size / side,
        stride,
        receiver,
        _pack_words(*np.nonzero(receiver)[::-1])[order],
        points[order],
        first,
        *_source_cells(lit, tiles),
        *_tile_triangles(atlas, side, tiles),
        *_gutter_copies(atlas, side),
    )


def _median_texel_mm(atlas: Atlas) -> float:
    """Return the median side length of the texels in `Atlas.lit_mask`, measured on the surface [mm]."""
    step = max(1, atlas.size // _MAX_AVERAGED_TEXELS_PER_SIDE)
    lit, stretch = atlas.lit_mask[::step, ::step], atlas.stretch[::step, ::step].astype(np.float32)
    density = stretch[..., 0][lit] * stretch[..., 1][lit]
    return float(1.0 / np.sqrt(np.median(density))) if len(density) else 1.0


def _centre_texels(atlas_side: int, cells_per_side: int) -> Index:
    """Return the index of the texel at the centre of each cell along one axis (cells_per_side,)."""
    return np.asarray(((np.arange(cells_per_side) + 0.5) * atlas_side / cells_per_side).astype(np.int64))


def _cells_with_marked_texels(texel_mask: Mask, atlas_side: int, cells_per_side: int, stride: int) -> Mask:
    """Return the mask (cells_per_side, cells_per_side) of cells that contain a marked texel.

    texel_mask : mask of every `stride`-th texel of the map along each axis
    atlas_side : texels along each side of the map
    """
    first = -(-np.arange(cells_per_side) * atlas_side // (cells_per_side * stride))
    rows = np.logical_or.reduceat(texel_mask, first, axis=0)
    return np.asarray(np.logical_or.reduceat(rows, first, axis=1))


def _dilate_cells(cell_mask: Mask) -> Mask:
    """Return a mask of cells dilated by one cell in all eight directions."""
    padded = np.pad(cell_mask, 1)
    rows = padded[:-2] | padded[1:-1] | padded[2:]
    return np.asarray(rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:])


def _sort_by_tile(tile_of_entry: NDArray[np.integer], tiles_per_side: int) -> tuple[Index, Index]:
    """Return the order (n,) that sorts entries by tile, and the index (t + 1,) of each tile's first entry.

    tile_of_entry : (n,) index of the tile to which each entry belongs
    tiles_per_side : tiles along each side of the atlas
    """
    order = np.argsort(tile_of_entry, kind="stable")
    return order, np.concatenate(
        [[0], np.cumsum(np.bincount(tile_of_entry, minlength=tiles_per_side * tiles_per_side))]
    )


def _source_cells(lit_mask: Mask, tiles_per_side: int) -> tuple[Index, Index]:
    """Return the fields `sources` and `source_first` of `Cells`."""
    y, x = np.nonzero(lit_mask)
    order, first = _sort_by_tile(
        (y // CELLS_PER_TILE_SIDE * tiles_per_side + x // CELLS_PER_TILE_SIDE).astype(np.int32),
        tiles_per_side,
    )
    return (y * len(lit_mask) + x)[order], first


def _tiles_of_points(atlas: Atlas, points: Words, cells_per_side: int, tiles_per_side: int) -> Ints:
    """Return the index (m,) of the tile of the atlas in which each surface point lies.

    A point may appear twice in the atlas: in the chart of its triangle, and in the gutter of another chart.
    The position in the chart determines the tile.

    points : (m, 2) triangle index, and packed barycentric weights
    cells_per_side, tiles_per_side : cells and tiles along each side of the atlas
    """
    uv = np.stack(_atlas_uv(atlas, points[:, 0], points[:, 1]))
    column, row = (
        np.clip(uv * np.float32(cells_per_side), 0, cells_per_side - 1).astype(np.int32)
        // CELLS_PER_TILE_SIDE
    )
    return np.asarray(row * tiles_per_side + column, np.int32)


def _pack_words(low_halves: NDArray[np.integer], high_halves: NDArray[np.integer]) -> Words:
    """Pack pairs of 16-bit integers into 32-bit words."""
    return np.asarray(low_halves.astype(np.uint32) | (high_halves.astype(np.uint32) << 16), np.uint32)


def _tile_triangles(atlas: Atlas, cells_per_side: int, tiles_per_side: int) -> tuple[Words, Words]:
    """Return the triangles that overlap each tile, sorted by tile.

    The results are the fields `triangle_first` (index of the first entry of each tile) and `triangles` of
    `Cells`. A triangle counts as overlapping a tile if its bounding box in uv overlaps the tile.
    """
    index = np.flatnonzero(atlas.mapped)
    uv, margin = atlas.corner_uv[index].astype(np.float64), TILE_MARGIN_TEXELS / atlas.size
    low, high = uv.min(axis=1) - margin, uv.max(axis=1) + margin
    first, last = (
        np.clip((uv * cells_per_side).astype(np.int64) // CELLS_PER_TILE_SIDE, 0, tiles_per_side - 1)
        for uv in (low, high)
    )
    width, height = (last - first + 1).T
    which, tile_in_box = expand_runs(np.zeros_like(width), width * height)
    x, y = first[which].T + np.stack([tile_in_box % width[which], tile_in_box // width[which]])
    order, begin = _sort_by_tile(y * tiles_per_side + x, tiles_per_side)
    return begin.astype(np.uint32), index[which[order]].astype(np.uint32)


def _gutter_copies(atlas: Atlas, cells_per_side: int) -> tuple[Index, Words]:
    """Return the texels that copy the light of another texel, each with the texel that it copies.

    The pairs are sorted by the cell of the copied texel. The results are the fields `gutter_copy_first`
    (index of the first pair of each cell) and `gutter_copies` (the pairs) of `Cells`.
    """
    rim, uv = _rim_texels(atlas)
    texel = np.concatenate([atlas.gutter, rim])
    x, y = np.clip(np.rint(np.concatenate([atlas.source, uv])), 0, atlas.size - 1).astype(np.int64).T
    cell = y * cells_per_side // atlas.size * cells_per_side + x * cells_per_side // atlas.size
    order = np.argsort(cell, kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=cells_per_side * cells_per_side))])
    return first, np.column_stack([_pack_words(*texel[order].T), _pack_words(x[order], y[order])])


def _rim_texels(atlas: Atlas) -> tuple[NDArray[np.uint16], Floats]:
    """Return the rim texels, and the positions inside charts that show the same surface points.

    Rim texels lie just outside a chart and are read by bilinear interpolation inside it. Their light is
    computed, not copied. Each represents a surface point that is also inside the chart of its triangle.
    Both arrays are (r, 2): x and y of the texels, and positions in the atlas [texel].
    """
    inner, view = np.pad(atlas.lit_mask, GUTTER_TEXELS), np.lib.stride_tricks.sliding_window_view
    for axis in (0, 1):
        inner = np.logical_and.reduce(view(inner, 2 * GUTTER_TEXELS + 1, axis), -1)
    y, x = np.nonzero(atlas.lit_mask & ~inner)
    texel, weights = np.stack([x, y], axis=-1), _pack_words(*atlas.barycentric[y, x].T)
    uv = np.stack(_atlas_uv(atlas, atlas.triangle[y, x], weights), axis=-1)
    uv = uv * np.float32(atlas.size) - np.float32(0.5)
    elsewhere = np.abs(uv - texel).max(axis=1, initial=0.0) > _SAME_POINT_TEXELS
    return texel[elsewhere].astype(np.uint16), uv[elsewhere]


def _atlas_uv(atlas: Atlas, triangle: NDArray[np.integer], weights: Words) -> list[Floats]:
    """Return the atlas coordinates u and v (v down) of points on triangles.

    triangle : (m,) triangle indices
    weights : (m,) packed weights of the second and third corner
    """
    corner = atlas.corner_uv[triangle].reshape(-1, 6)
    b, c = (part.astype(np.float32) / np.float32(65535) for part in (weights & 0xFFFF, weights >> 16))
    axes = (corner[:, axis::2].T for axis in range(2))
    return [first + b * (second - first) + c * (third - first) for first, second, third in axes]
