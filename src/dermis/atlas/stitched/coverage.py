"""Surface points at the texels of chart pieces and gutters, with stretch and edge distances of the texels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.raster import connected_run_lengths
from dermis.atlas.stitched.gutter import Border, GutterTexels, GutterWidth, Packing, trace_gutter
from dermis.atlas.stitched.surface import FlatSurface, interpolate_corners
from dermis.atlas.stitched.texels import (
    AnchoredTexels,
    anchors_diverge,
    gap_limit_mm,
    mostly_hidden_triangles,
    rasterise_texel_triangles,
    texel_centre_weights,
    unconnected_pairs,
)
from dermis.base.arrays import Floats, Index, Ints, Mask


@dataclass(frozen=True)
class Coverage:
    """Surface points that the texels of an (h, w) grid show.

    The anchor of a texel is the nearest point of the piece to which the texel belongs. For a texel inside the
    piece, the anchor is the point that the texel shows; for a gutter texel, it is a point on the border.

    triangle : (h, w) index of the triangle that the texel shows, -1 if there is none
    weights : (h, w, 2) barycentric weights of that triangle's second and third corner
    anchor_triangle : (h, w) index of the anchor's triangle, -1 if there is none
    anchor_weights : (h, w, 2) barycentric weights of the anchor in its triangle
    piece : (h, w) index of the piece to which the texel belongs, -1 if there is none
    gutter : (h, w) mask of gutter texels, into which light is copied
    distance_mm : (h, w) distance of the texel from the piece, measured on the surface [mm]
    """

    triangle: Ints
    weights: Floats
    anchor_triangle: Ints
    anchor_weights: Floats
    piece: Ints
    gutter: Mask
    distance_mm: Floats


def compute_coverage(
    surface: FlatSurface,
    triangle_piece: Index,
    member_triangles: Index,
    border: Border,
    packing: Packing,
    gutter_width: GutterWidth,
    grid_shape: tuple[int, int],
) -> Coverage:
    """Compute the surface point that each texel shows, for packed chart pieces and their gutters.

    triangle_piece : (f,) index of each triangle's chart piece, -1 for triangles in no piece
    member_triangles : (t,) indices of the triangles to rasterise
    border : border of the pieces, see `find_border`
    packing : positions of the triangles on the texel grid
    gutter_width : width of the gutters
    grid_shape : height and width of the grid of texels
    """
    owner = rasterise_texel_triangles(
        packing.corners, _drawing_order(surface, triangle_piece, member_triangles), grid_shape
    )
    weights = texel_centre_weights(packing.corners, owner)
    coverage = Coverage(
        owner,
        weights,
        anchor_triangle=owner.copy(),
        anchor_weights=weights.copy(),
        piece=np.empty(grid_shape, np.int32),
        gutter=np.zeros(grid_shape, np.bool_),
        distance_mm=np.zeros(grid_shape, np.float32),
    )
    _add_gutters(coverage, triangle_piece, trace_gutter(surface, border, packing, gutter_width, owner))
    coverage.piece[:] = np.where(coverage.anchor_triangle >= 0, triangle_piece[coverage.anchor_triangle], -1)
    return coverage


def _add_gutters(coverage: Coverage, triangle_piece: Index, texels: GutterTexels) -> None:
    """Add rims and gutters, the texels around chart pieces, to a coverage that contains only the pieces.

    The rim of a piece consists of the texels outside it that are read by bilinear interpolation within it.

    triangle_piece : (f,) index of each triangle's chart piece, -1 for triangles in no piece
    """
    y, x = texels.y, texels.x
    coverage.triangle[y, x], coverage.weights[y, x] = texels.triangle, texels.weights
    coverage.anchor_triangle[y, x] = texels.anchor_triangle
    coverage.anchor_weights[y, x] = texels.anchor_weights
    coverage.distance_mm[y, x] = texels.distance_mm
    coverage.gutter[y, x] = ~texels.rim
    ended = np.zeros(coverage.gutter.shape, np.bool_)
    ended[y, x] = ~texels.complete
    incomplete = ~texels.complete & ~texels.rim
    coverage.triangle[y[incomplete], x[incomplete]] = -1
    _extend_surface_edge(coverage, triangle_piece, ended, y[incomplete], x[incomplete])
    # gutters end where the surface has no texels in the atlas
    unlit = coverage.gutter & ((coverage.triangle < 0) | (triangle_piece[coverage.triangle] < 0))
    for grid in (coverage.triangle, coverage.anchor_triangle):
        grid[unlit] = -1
    coverage.gutter[unlit] = False


def hidden_triangles(surface: FlatSurface, triangle_piece: Index, packing: Packing, atlas_side: int) -> Mask:
    """Return the mask (f,) of triangles that are mostly hidden in uv by other triangles of their piece.

    triangle_piece : (f,) index of each triangle's chart piece, -1 for triangles in no piece
    packing : positions of the triangles on the texel grid
    """
    members = np.flatnonzero(triangle_piece >= 0)
    owner = rasterise_texel_triangles(
        packing.corners, _drawing_order(surface, triangle_piece, members), (atlas_side, atlas_side)
    )
    return mostly_hidden_triangles(packing.corners, members, owner)


def _drawing_order(surface: FlatSurface, triangle_piece: Index, member_triangles: Index) -> Index:
    """Return triangle indices sorted so that triangles mirrored within their piece come first.

    Triangles that are drawn later replace earlier ones, so mirrored triangles get only the texels that no
    unmirrored triangle covers.

    triangle_piece : (f,) index of each triangle's chart piece, -1 for triangles in no piece
    member_triangles : (t,) indices of the triangles to sort
    """
    return member_triangles[
        np.argsort(
            ~_mirrored_triangles(surface, triangle_piece[member_triangles], member_triangles), kind="stable"
        )
    ]


def _mirrored_triangles(surface: FlatSurface, member_piece: Index, member_triangles: Index) -> Mask:
    """Return the mask (t,) of triangles that are mirrored in uv relative to most triangles of their piece.

    member_piece : (t,) piece of each triangle to examine
    member_triangles : (t,) indices of these triangles
    """
    total = np.bincount(member_piece, surface.uv_area[member_triangles])
    return np.asarray(np.sign(total)[member_piece] != np.sign(surface.uv_area[member_triangles]))


def _extend_surface_edge(
    coverage: Coverage, triangle_piece: Index, is_beyond_surface: Mask, y: Index, x: Index
) -> None:
    """Copy neighbouring texels to gutter texels just beyond an edge at which the surface ends.

    A blur along the edge then reads the same light from a gutter as from the chart piece beside it.

    coverage : surface points that the texels represent, changed in place
    triangle_piece : (f,) index of each triangle's chart piece, -1 for triangles in no piece
    is_beyond_surface : (h, w) mask of texels beyond the end of the surface
    y, x : (n,) row and column of each gutter texel to fill; `is_beyond_surface` is True at these texels
    """
    last = np.array(is_beyond_surface.shape) - 1
    piece_of_texel, from_y, from_x = triangle_piece[coverage.anchor_triangle[y, x]], y.copy(), x.copy()
    for dy, dx in ((0, -1), (0, 1), (-1, 0), (1, 0)):
        next_y, next_x = np.clip(y + dy, 0, last[0]), np.clip(x + dx, 0, last[1])
        anchor = coverage.anchor_triangle[next_y, next_x]
        same = (anchor >= 0) & ~is_beyond_surface[next_y, next_x] & (triangle_piece[anchor] == piece_of_texel)
        from_y, from_x = np.where(same, next_y, from_y), np.where(same, next_x, from_x)
    for grid in (coverage.triangle, coverage.weights):
        grid[y, x] = grid[from_y, from_x]


def texel_metric(surface: FlatSurface, packing: Packing, coverage: Coverage) -> Floats:
    """Return texels per mm along u and v, and the cosine of the angle between u and v, (h, w, 3).

    A gutter texel has the metric of its anchor, the nearest point of its chart.

    packing : positions of the triangles on the texel grid
    coverage : surface points that the texels represent
    """
    covered = coverage.anchor_triangle >= 0
    anchor, weights = coverage.anchor_triangle[covered], coverage.anchor_weights[covered]
    metric = np.zeros((*covered.shape, 3), np.float32)
    found = interpolate_corners(surface.uv_metric.astype(np.float32), anchor, weights)
    texels_per_uv = packing.texels_per_uv[anchor].astype(np.float32)
    found[:, :2] = texels_per_uv[:, None] / np.maximum(found[:, :2], 1e-3)
    metric[covered] = found
    return metric


def edge_distances(surface: FlatSurface, packing: Packing, coverage: Coverage) -> NDArray[np.uint16]:
    """Return the number of connected texels in each direction from each texel, (h, w, 4).

    The last axis is for the directions left, right, up and down. Adjacent texels are connected if both belong
    to the same chart piece or its gutter, and if there is no gap on the surface between the points that they
    represent.

    packing : positions of the triangles on the texel grid
    coverage : surface points that the texels represent
    """
    anchor = coverage.anchor_triangle
    owner = np.where(anchor >= 0, np.where(coverage.distance_mm > 0, -1, anchor), -2)
    distance = np.empty((*owner.shape, 4), np.uint16)
    for axis in (0, 1):
        joined = np.zeros(owner.shape, np.bool_)
        here, before = np.moveaxis(joined, 1 - axis, 0)[1:], np.moveaxis(coverage.piece, 1 - axis, 0)
        here[:] = (before[1:] >= 0) & (before[1:] == before[:-1])
        first, second = unconnected_pairs(surface, owner, axis)
        same = joined.ravel()[second]
        joined.ravel()[second[same]] = ~_pairs_with_gap(
            surface, packing, coverage, first[same], second[same], axis
        )
        runs = connected_run_lengths(np.moveaxis(joined, 1 - axis, 1))
        distance[..., 2 * axis], distance[..., 2 * axis + 1] = (np.moveaxis(one, 1, 1 - axis) for one in runs)
    return distance


def _pairs_with_gap(
    surface: FlatSurface,
    packing: Packing,
    coverage: Coverage,
    first_texels: Index,
    second_texels: Index,
    axis: int,
) -> Mask:
    """Return the mask (n,) of pairs of adjacent texels whose surface points are not adjacent.

    A pair is selected if two conditions hold: the anchors of its texels (the nearest points of the chart
    piece) are far apart, see `anchors_diverge`, and its surface points are farther apart than `gap_limit_mm`.

    packing : positions of the triangles on the texel grid
    coverage : surface points that the texels represent
    first_texels, second_texels : (n,) flat indices of the texels
    axis : 0 for pairs along x, 1 along y
    """
    one, other = (
        _anchored_texels(surface, packing, coverage, texel) for texel in (first_texels, second_texels)
    )
    triangle, weights = coverage.triangle.ravel(), coverage.weights.reshape(-1, 2)
    points = [surface.points(triangle[texel], weights[texel]) for texel in (first_texels, second_texels)]
    distance_mm = np.linalg.norm(points[0] - points[1], axis=1)
    return np.asarray(anchors_diverge(one, other) & (distance_mm > gap_limit_mm(one, other, axis)))


def _anchored_texels(
    surface: FlatSurface, packing: Packing, coverage: Coverage, texel: Index
) -> AnchoredTexels:
    anchor, weights = coverage.anchor_triangle.ravel()[texel], coverage.anchor_weights.reshape(-1, 2)[texel]
    texels = np.column_stack(np.divmod(texel, coverage.anchor_triangle.shape[1])[::-1]).astype(np.float64)
    steps = surface.uv_metric[anchor, 0, :2] / packing.texels_per_uv[anchor, None]
    return AnchoredTexels(texels, interpolate_corners(packing.corners, anchor, weights), steps)
