"""The stitched atlas, step by step: pieces, cuts, packing, gutters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import MAX_SHEAR, Atlas
from dermis.atlas.stitched.coverage import (
    Coverage,
    compute_coverage,
    edge_distances,
    hidden_triangles,
    texel_metric,
)
from dermis.atlas.stitched.gutter import GutterWidth, Packing, find_border
from dermis.atlas.stitched.overlap_cuts import cut_overlaps
from dermis.atlas.stitched.pack import pack_pieces
from dermis.atlas.stitched.surface import Doubles, FlatSurface, Index, flat_surface
from dermis.atlas.unwrap.charts import connected_pieces
from dermis.mesh.mesh import Mesh

_COLLAPSED = 0.05  # of the mesh's mean density: what has less holds nothing that could be blurred
_SPECK_MM2 = 1.0  # mirrored parts under this stay with the chart around them
_EVEN = (0.5, 1.4)  # of the mean density: charts that have more or less are moved halfway towards it
_WIDEST = 1 / 8  # of the map's side, for gutters


def find_pieces(surface: FlatSurface) -> tuple[Index, Doubles]:
    """Piece of each triangle (f,), -1 without a place, and scale (f,) of its uv that evens out density."""
    mirrored = (surface.area_uv < 0).astype(np.int64)
    neighbour = surface.uv_neighbour
    chart = connected_pieces(np.zeros(len(mirrored), np.int64), neighbour)
    piece = connected_pieces(2 * chart + mirrored, neighbour)
    piece = _with_specks(surface, chart, piece)
    piece = np.where(surface.valid, piece, -1)
    density, mean = _density(surface, piece)
    piece[density < _COLLAPSED * mean] = -1
    density, mean = _density(surface, piece)
    low, high = (limit * mean for limit in _EVEN)
    wanted = np.where(density < low, np.sqrt(low * density), density)
    wanted = np.where(density > high, np.sqrt(high * density), wanted)
    return renumbered(piece), np.where(piece >= 0, wanted / np.maximum(density, 1e-12), 1.0)


def renumbered(piece: Index) -> Index:
    """The same pieces (f,), counted from 0; -1 stays."""
    numbers, again = np.unique(piece, return_inverse=True)
    return np.asarray(again.reshape(-1) - np.count_nonzero(numbers < 0), dtype=np.int64)


def _with_specks(surface: FlatSurface, chart: Index, piece: Index) -> Index:
    """Pieces with the small ones given to the largest of their chart."""
    area = np.bincount(piece, surface.area_mm2 * surface.valid)
    order = np.argsort(area[piece], kind="stable")
    largest = np.zeros(int(chart.max()) + 1, np.int64)
    largest[chart[order]] = piece[order]
    return np.where(area[piece] < _SPECK_MM2, largest[chart], piece)


def _density(surface: FlatSurface, piece: Index) -> tuple[Doubles, float]:
    """Side of each triangle's piece in uv over that in space (f,) [1/mm], and of all together."""
    inside, number = piece >= 0, np.maximum(piece, 0)
    uv = np.bincount(number, np.abs(surface.area_uv) * inside)
    mm2 = np.bincount(number, surface.area_mm2 * inside)
    mean = float(np.sqrt(uv.sum() / max(mm2.sum(), 1e-12)))
    return np.where(inside, np.sqrt(uv / np.maximum(mm2, 1e-12))[number], mean), mean


def build_stitched(mesh: Mesh, size: int, gutter_mm: float) -> Atlas | None:
    """The atlas in which every chart has room of its own, and a gutter that shows what lies across its seams.

    None when there are too many charts for the texels.

    reach_mm : width of the gutters
    """
    surface = flat_surface(mesh)
    piece, scale = find_pieces(surface)
    piece = cut_overlaps(surface, piece, gutter_mm)
    width = GutterWidth(gutter_mm, _WIDEST * size)
    packing = pack_pieces(surface, piece, scale, size, width)
    if packing is None:
        return None
    # where a piece overlaps itself only one layer has light: gutters must not read the other
    piece = np.where(hidden_triangles(surface, piece, packing, size), -1, piece)
    own = np.flatnonzero(piece >= 0)
    made = compute_coverage(surface, piece, own, find_border(surface, piece, own), packing, width, (size, size))
    return _atlas(surface, packing, made, piece >= 0)


def _atlas(surface: FlatSurface, packing: Packing, made: Coverage, mapped: NDArray[np.bool_]) -> Atlas:
    size = len(made.triangle)
    metric = texel_metric(surface, packing, made)
    reach = edge_distances(surface, packing, made)
    y, x = np.nonzero(made.gutter)
    second = made.weights[y, x].astype(np.float64)
    weights = np.column_stack((1 - second.sum(axis=1), second))
    source = np.einsum("nk,nka->na", weights, packing.corners[made.triangle[y, x]])
    place = np.where(mapped[:, None, None], (packing.corners + 0.5) / size, 0.0)
    # the rims of pieces show what lies across a seam, but are stretched as their own side of it
    outer = (made.rooted >= 0) & ((made.rooted != made.triangle) | made.gutter)
    row, column = np.nonzero(outer)
    shear = np.clip(metric[..., 2], -MAX_SHEAR, MAX_SHEAR)
    return Atlas(
        triangle=made.triangle,
        barycentric=np.floor(made.weights * 65535.0).astype(np.uint16),
        stretch=np.minimum(metric[..., :2], 6e4).astype(np.float16),
        shear=shear.astype(np.float16),
        reach=reach,
        place=place.astype(np.float32),
        gutter=np.column_stack((x, y)).astype(np.uint16),
        source=source.astype(np.float32),
        beyond=np.column_stack((column, row)).astype(np.uint16),
        root=made.rooted[row, column],
        root_weight=np.floor(made.roots[row, column] * 65535.0).astype(np.uint16),
        texels_per_uv=packing.texels_per_uv.astype(np.float32),
        mapped=mapped,
    )
