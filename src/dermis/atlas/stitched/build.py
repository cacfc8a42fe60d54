"""Construction of the stitched atlas: division of charts into pieces, packing and gutters."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import MAX_SHEAR, Atlas
from dermis.atlas.shipped import shipped_arrays
from dermis.atlas.stitched.coverage import (
    Coverage,
    compute_coverage,
    edge_distances,
    hidden_triangles,
    texel_metric,
)
from dermis.atlas.stitched.gutter import GutterWidth, Packing, find_border
from dermis.atlas.stitched.overlap_cuts import cut_overlaps
from dermis.atlas.stitched.pack import MAX_CELLS_PER_SIDE, PieceLayout, find_piece_layout, pack_pieces
from dermis.atlas.stitched.surface import FlatSurface, flat_surface
from dermis.atlas.unwrap.charts import connected_pieces
from dermis.base.arrays import Doubles, Index, Mask
from dermis.mesh.mesh import Mesh

_MIN_RELATIVE_UV_DENSITY = (
    0.05  # lowest ratio of a piece's uv density to the mean at which light is blurred in it
)
_MAX_SPECK_MM2 = 1.0  # parts of a chart with less area are merged into its largest part
_RELATIVE_UV_DENSITY_RANGE = (
    0.5,
    1.4,
)  # ratio of uv density to the mean; pieces outside are scaled towards this range
_MAX_GUTTER_FRACTION = 1 / 8  # largest width of gutters as a fraction of the map's side
_LAYOUT_VERSION = 1  # increment when `find_stitched_layout` gives other results, and write the tables again
LAYOUT_ARRAY_NAMES = "piece", "scale", "origins"
"""Names of the arrays of `find_stitched_layout`."""


def find_chart_pieces(surface: FlatSurface) -> tuple[Index, Doubles]:
    """Divide charts into pieces; return a piece index (f,) and a uv scale (f,) for each triangle.

    A piece is a chart, or a part of a chart whose uv is mirrored. Triangles in no piece have the index -1.
    If uv is multiplied by the scales, all pieces have a similar texel density.
    """
    mirrored = (surface.uv_area < 0).astype(np.int64)
    neighbour = surface.uv_neighbour
    chart = connected_pieces(np.zeros(len(mirrored), np.int64), neighbour)
    piece = connected_pieces(2 * chart + mirrored, neighbour)
    piece = _merge_small_pieces(surface, chart, piece)
    piece = np.where(surface.valid, piece, -1)
    density, mean = _uv_density(surface, piece)
    piece[density < _MIN_RELATIVE_UV_DENSITY * mean] = -1
    density, mean = _uv_density(surface, piece)
    low, high = (limit * mean for limit in _RELATIVE_UV_DENSITY_RANGE)
    target = np.where(density < low, np.sqrt(low * density), density)
    target = np.where(density > high, np.sqrt(high * density), target)
    return renumber_pieces(piece), np.where(piece >= 0, target / np.maximum(density, 1e-12), 1.0)


def renumber_pieces(triangle_piece: Index) -> Index:
    """Renumber piece indices (f,) of triangles from 0 without gaps; -1 for triangles in no piece is kept."""
    numbers, index = np.unique(triangle_piece, return_inverse=True)
    return np.asarray(index.reshape(-1) - np.count_nonzero(numbers < 0), dtype=np.int64)


def _merge_small_pieces(surface: FlatSurface, triangle_chart: Index, triangle_piece: Index) -> Index:
    """Merge pieces (parts of charts) of less than 1 mm2 into the largest piece of their chart.

    Returns the piece of each triangle (f,) after the merger.

    triangle_chart, triangle_piece : (f,) chart of each triangle, and its piece before the merger
    """
    area = np.bincount(triangle_piece, surface.area_mm2 * surface.valid)
    order = np.argsort(area[triangle_piece], kind="stable")
    largest = np.zeros(int(triangle_chart.max()) + 1, np.int64)
    largest[triangle_chart[order]] = triangle_piece[order]
    return np.where(area[triangle_piece] < _MAX_SPECK_MM2, largest[triangle_chart], triangle_piece)


def _uv_density(surface: FlatSurface, triangle_piece: Index) -> tuple[Doubles, float]:
    """Return the uv density of each triangle's piece (f,), and the mean over all pieces [1/mm].

    The density is the square root of the ratio of uv area to surface area: the average length in uv of 1 mm
    on the surface.
    """
    inside, index = triangle_piece >= 0, np.maximum(triangle_piece, 0)
    uv = np.bincount(index, np.abs(surface.uv_area) * inside)
    mm2 = np.bincount(index, surface.area_mm2 * inside)
    mean = float(np.sqrt(uv.sum() / max(mm2.sum(), 1e-12)))
    return np.where(inside, np.sqrt(uv / np.maximum(mm2, 1e-12))[index], mean), mean


def build_stitched(mesh: Mesh, atlas_side: int, gutter_mm: float) -> Atlas | None:
    """Build the atlas of a stitched layout, in which gutters show the surface across the seams of each chart.

    Charts are moved apart to make space for the gutters. The result is None if the charts with their gutters
    do not fit into the map.

    atlas_side : texels along each side of the map
    gutter_mm : width of the gutters [mm]
    """
    surface = flat_surface(mesh)
    piece, scale = find_chart_pieces(surface)
    width = GutterWidth(gutter_mm, _MAX_GUTTER_FRACTION * atlas_side)
    shipped = (
        shipped_arrays(mesh, layout_table_name(gutter_mm), LAYOUT_ARRAY_NAMES)
        if atlas_side >= MAX_CELLS_PER_SIDE
        else None
    )
    if shipped is None:
        piece, layout = cut_overlaps(surface, piece, gutter_mm), None
    else:
        piece = shipped["piece"].astype(np.int64)
        layout = PieceLayout(float(shipped["scale"]), shipped["origins"])
    packing = pack_pieces(surface, piece, scale, atlas_side, width, layout)
    if packing is None:
        return None
    # where a piece overlaps itself, only one layer owns texels, and gutters must not read the hidden one
    piece = np.where(hidden_triangles(surface, piece, packing, atlas_side), -1, piece)
    members = np.flatnonzero(piece >= 0)
    border = find_border(surface, piece, members)
    coverage = compute_coverage(surface, piece, members, border, packing, width, (atlas_side, atlas_side))
    return _assemble_atlas(surface, packing, coverage, piece >= 0)


def layout_table_name(gutter_mm: float) -> str:
    """Return the name under which the package stores the stitched layout of a mesh, for `shipped_arrays`.

    The stored layout consists of the chart pieces and their positions in maps of at least 512 x 512 texels.
    """
    return f"layout {_LAYOUT_VERSION} {gutter_mm:g}"


def find_stitched_layout(mesh: Mesh, gutter_mm: float) -> dict[str, NDArray[Any]]:
    """Compute the stitched layout of a mesh as arrays.

    For the head that comes with the package, these arrays are computed in advance and stored in a file.

    Returns three arrays: the piece index (f,) of each triangle, and scale and origins of the `PieceLayout`.

    Raises ValueError if the charts do not fit.
    """
    surface = flat_surface(mesh)
    piece, scale = find_chart_pieces(surface)
    piece = cut_overlaps(surface, piece, gutter_mm)
    width = GutterWidth(gutter_mm, _MAX_GUTTER_FRACTION * MAX_CELLS_PER_SIDE)
    layout = find_piece_layout(surface, piece, scale, MAX_CELLS_PER_SIDE, width)
    if layout is None:
        raise ValueError("the charts do not fit")
    values = piece.astype(np.int16), np.float64(layout.scale), layout.origins
    return {name: np.asarray(value) for name, value in zip(LAYOUT_ARRAY_NAMES, values, strict=True)}


def _assemble_atlas(
    surface: FlatSurface, packing: Packing, coverage: Coverage, mapped_triangles: Mask
) -> Atlas:
    size = len(coverage.triangle)
    metric = texel_metric(surface, packing, coverage)
    distances = edge_distances(surface, packing, coverage)
    y, x = np.nonzero(coverage.gutter)
    bc = coverage.weights[y, x].astype(np.float64)
    weights = np.column_stack((1 - bc.sum(axis=1), bc))
    source = np.einsum("nk,nka->na", weights, packing.corners[coverage.triangle[y, x]])
    corner_uv = np.where(mapped_triangles[:, None, None], (packing.corners + 0.5) / size, 0.0)
    # the rim of a piece shows the surface across a seam, but with the stretch of its own side
    elsewhere = (coverage.anchor_triangle != coverage.triangle) | coverage.gutter
    row, column = np.nonzero((coverage.anchor_triangle >= 0) & elsewhere)
    shear = np.clip(metric[..., 2], -MAX_SHEAR, MAX_SHEAR)
    return Atlas(
        triangle=coverage.triangle,
        barycentric=np.floor(coverage.weights * 65535.0).astype(np.uint16),
        stretch=np.minimum(metric[..., :2], 6e4).astype(np.float16),
        shear=shear.astype(np.float16),
        edge_distance=distances,
        corner_uv=corner_uv.astype(np.float32),
        gutter=np.column_stack((x, y)).astype(np.uint16),
        source=source.astype(np.float32),
        outside=np.column_stack((column, row)).astype(np.uint16),
        border_triangle=coverage.anchor_triangle[row, column],
        border_weights=np.floor(coverage.anchor_weights[row, column] * 65535.0).astype(np.uint16),
        texels_per_uv=packing.texels_per_uv.astype(np.float32),
        mapped=mapped_triangles,
    )
