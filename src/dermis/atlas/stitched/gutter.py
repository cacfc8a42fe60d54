"""Borders of packed chart pieces, and gutter texels around them that continue the surface.

A piece is a chart, or a part of a chart that is mirrored or was cut off. The rim of a piece consists of the
texels outside it that are read by bilinear interpolation within it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.raster import covered_texels
from dermis.atlas.stitched.geodesics import GeodesicEnds, trace_geodesics
from dermis.atlas.stitched.nearest import BorderSides, NearestPoints, nearest_border_points
from dermis.atlas.stitched.surface import FlatSurface
from dermis.base.arrays import Doubles, Index, Ints, Mask

_MAX_GUTTER_STRETCH = (
    2.0  # largest width of a gutter on the grid, relative to the width at its piece's mean density
)


class Border(NamedTuple):
    """Triangle sides that form the borders of chart pieces.

    triangle : (k,) index of the triangle
    side : (k,) side of the triangle: 0 for corners 01, 1 for 12, 2 for 20
    seam : (k,) mask of sides across which the surface continues
    """

    triangle: Index
    side: Index
    seam: Mask


class Packing(NamedTuple):
    """Positions of f triangles on the texel grid of the atlas.

    corners : (f, 3, 2) corners [texel]; texel centres are at integers
    texels_per_uv : (f,) texels per unit of the mesh's uv
    texels_per_mm : (f,) texels per mm on the surface; all triangles of a piece have the piece's average
    """

    corners: Doubles
    texels_per_uv: Doubles
    texels_per_mm: Doubles


class GutterWidth(NamedTuple):
    """Width of gutters on the surface [mm], and their largest allowed width on the grid [texel]."""

    gutter_mm: float
    max_texels: float


def find_border(surface: FlatSurface, triangle_piece: Index, member_triangles: Index) -> Border:
    """Return the triangle sides that form the borders of chart pieces.

    triangle_piece : (f,) index of each triangle's chart piece, -1 for triangles in no piece
    member_triangles : (t,) indices of the triangles whose sides are examined; each triangle is in a piece
    """
    neighbour = surface.uv_neighbour[member_triangles]
    row, index = np.nonzero(
        (neighbour == member_triangles[:, None])
        | (triangle_piece[member_triangles, None] != triangle_piece[neighbour])
    )
    triangle = member_triangles[row]
    across = surface.adjacency.neighbour[triangle, index]
    return Border(triangle, index, (across >= 0) & surface.adjacency.passable[across])


def border_sides(
    surface: FlatSurface, border: Border, packing: Packing, gutter_width: GutterWidth
) -> BorderSides:
    """Return the border sides on the texel grid, with surface metric and gutter width.

    border : border of the pieces, see `find_border`
    packing : positions of the triangles on the texel grid
    gutter_width : width of the gutters
    """
    triangle, both = border.triangle, (border.side, (border.side + 1) % 3)
    ends = np.stack([packing.corners[triangle, k] for k in both], axis=1)
    steps = np.stack([surface.uv_tangents[triangle, k] for k in both], axis=1)
    steps = steps / packing.texels_per_uv[triangle][:, None, None, None]
    # slivers may be stretched a hundredfold, where gutters in proportion would waste space
    max_texels = np.minimum(
        gutter_width.max_texels,
        _MAX_GUTTER_STRETCH * gutter_width.gutter_mm * packing.texels_per_mm[triangle],
    )
    return BorderSides(ends, steps, np.where(border.seam, gutter_width.gutter_mm, 0.0), max_texels)


def needed_texels(
    surface: FlatSurface,
    member_triangles: Index,
    border: Border,
    packing: Packing,
    gutter_width: GutterWidth,
    grid_shape: tuple[int, int],
) -> Mask:
    """Return the mask (h, w) of texels that chart pieces, their rims and their gutters may need.

    The rim of a piece consists of the texels outside it that are read by bilinear interpolation within it.

    member_triangles : (t,) indices of the triangles of the pieces
    border : border of the pieces, see `find_border`
    packing : positions of the triangles on the texel grid
    gutter_width : width of the gutters
    grid_shape : height and width of the grid of texels
    """
    found = np.zeros(grid_shape, np.bool_)
    found.ravel()[covered_texels(packing.corners[member_triangles], grid_shape)[0]] = True
    found.ravel()[
        nearest_border_points(border_sides(surface, border, packing, gutter_width), found).texel
    ] = True
    return found


class GutterTexels(NamedTuple):
    """Gutter and rim texels (n,) outside the triangles of a piece, with their surface points.

    y, x : row and column
    rim : mask of texels that are read by bilinear interpolation within the piece
    distance_mm : distance of the texel from the piece, measured on the surface [mm]
    anchor_triangle : index of the triangle with the anchor, the border point nearest to the texel
    anchor_weights : barycentric weights of this triangle's second and third corner at the anchor
    triangle : index of the triangle in which the geodesic from the anchor to the texel ends
    weights : barycentric weights of this triangle's second and third corner at the end of the geodesic
    complete : mask of texels that the geodesic reached before the surface ended
    """

    y: Index
    x: Index
    rim: Mask
    distance_mm: Doubles
    anchor_triangle: Ints
    anchor_weights: Doubles
    triangle: Ints
    weights: Doubles
    complete: Mask


def trace_gutter(
    surface: FlatSurface, border: Border, packing: Packing, gutter_width: GutterWidth, texel_triangle: Ints
) -> GutterTexels:
    """Find the gutter texels along the border of chart pieces, and the surface point of each gutter texel.

    To find this point, a geodesic is traced over the surface from the nearest point of the border.

    border : border of the pieces, see `find_border`
    packing : positions of the triangles on the texel grid
    gutter_width : width of the gutters
    texel_triangle : (h, w) index of the triangle that covers each texel, -1 for texels outside the pieces
    """
    nearest = nearest_border_points(
        sides := border_sides(surface, border, packing, gutter_width), texel_triangle >= 0
    )
    texels = np.column_stack(np.divmod(nearest.texel, texel_triangle.shape[1])[::-1])
    ends, weights = trace_from_border(surface, border, sides, nearest, texels)
    y, x = texels.T[::-1]
    anchor_triangle = border.triangle[nearest.side].astype(np.int32)
    return GutterTexels(y, x, nearest.rim, nearest.distance_mm, anchor_triangle, weights, *ends)


def trace_from_border(
    surface: FlatSurface,
    border: Border,
    sides: BorderSides,
    nearest_points: NearestPoints,
    texels: NDArray[Any],
) -> tuple[GeodesicEnds, Doubles]:
    """Trace a geodesic from the nearest border point of each texel to the surface point that the texel shows.

    Returns the ends of the geodesics. Also returns the barycentric weights (n, 2) of the border triangle's
    second and third corner at the start of each geodesic.

    sides : border sides on the texel grid
    nearest_points : nearest border point of each texel
    texels : (n, 2) x and y of the texels
    """
    t, anchor_triangle = nearest_points.fraction[:, None], border.triangle[nearest_points.side]
    first, rows = border.side[nearest_points.side], np.arange(len(anchor_triangle))
    second = (first + 1) % 3
    corners = surface.adjacency.planar_corners
    start = _interpolate_linearly(corners[anchor_triangle, first], corners[anchor_triangle, second], t)
    offset = texels - border_points(sides, nearest_points)
    step = np.einsum("ns,nsa->na", offset, border_texel_steps(sides, nearest_points))
    corner = np.zeros((len(anchor_triangle), 3))
    corner[rows, first], corner[rows, second] = 1 - t[:, 0], t[:, 0]
    return trace_geodesics(surface.adjacency, anchor_triangle, start, start + step), corner[:, 1:]


def border_points(sides: BorderSides, nearest_points: NearestPoints) -> Doubles:
    """Return the positions (n, 2) of nearest border points on the texel grid [texel]."""
    first, second = np.moveaxis(sides.ends[nearest_points.side], 1, 0)
    return _interpolate_linearly(first, second, nearest_points.fraction[:, None])


def border_texel_steps(sides: BorderSides, nearest_points: NearestPoints) -> Doubles:
    """Return the surface vectors of steps by one texel at n border points, (n, 2, 2) [mm].

    The second axis is for the step, to the right or down. The third axis has the two components of the vector
    in the plane of the border triangle.
    """
    first, second = np.moveaxis(sides.steps[nearest_points.side], 1, 0)
    return _interpolate_linearly(first, second, nearest_points.fraction[:, None, None])


def _interpolate_linearly(start_values: Doubles, end_values: Doubles, fraction: Doubles) -> Doubles:
    return np.asarray(start_values + (end_values - start_values) * fraction)
