"""Rasterised triangles, and tests whether adjacent texels are also adjacent on the surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.atlas.raster import barycentric_weights, covered_texels
from dermis.atlas.stitched.surface import FlatSurface
from dermis.base.arrays import Doubles, Floats, Index, Ints, Mask

# There is a gap between texels whose surface points are farther apart than this many steps plus the slack.
_GAP_LIMIT_TEXEL_STEPS, _GAP_SLACK_MM = 2.0, 0.5
_INNER_MARGIN_TEXELS = 1e-3  # texel centres this far inside an edge are not in the triangle across it [texel]


def rasterise_texel_triangles(corners: Doubles, drawn_triangles: Index, grid_shape: tuple[int, int]) -> Ints:
    """Draw triangles; return the last triangle that covers each texel centre (h, w), -1 if there is none.

    corners : (f, 3, 2) corners of all triangles [texel]
    drawn_triangles : (t,) indices in drawing order
    grid_shape : height and width of the grid of texels
    """
    owner = np.full(grid_shape, -1, np.int32)
    texel, which = covered_texels(corners[drawn_triangles], grid_shape)
    owner.ravel()[texel] = drawn_triangles[which]
    return owner


def mostly_hidden_triangles(corners: Doubles, drawn_triangles: Index, texel_triangle: Ints) -> Mask:
    """Return the mask (f,) of triangles that own less than half of the texels that they cover.

    Their other texels belong to triangles that are drawn over them.

    corners : (f, 3, 2) corners of all triangles [texel]
    drawn_triangles : (t,) indices of the drawn triangles
    texel_triangle : (h, w) triangle to which each texel belongs, from `rasterise_texel_triangles`
    """
    texel, which = covered_texels(corners[drawn_triangles], texel_triangle.shape, _INNER_MARGIN_TEXELS)
    drawn, count = drawn_triangles[which], len(corners)
    owned = np.bincount(drawn[texel_triangle.ravel()[texel] == drawn], minlength=count)
    return np.asarray(owned < 0.5 * np.bincount(drawn, minlength=count))


def texel_centre_weights(corners: Doubles, texel_triangle: Ints) -> Floats:
    """Return the barycentric weights (h, w, 2) of the second and third corner at each texel centre.

    corners : (f, 3, 2) corners of all triangles [texel]
    texel_triangle : (h, w) triangle to which each texel belongs, -1 if there is none
    """
    y, x = np.nonzero(texel_triangle >= 0)
    weights = np.zeros((*texel_triangle.shape, 2), np.float32)
    weights[y, x] = barycentric_weights(corners[texel_triangle[y, x]], np.column_stack((x, y)))
    return weights


class AnchoredTexels(NamedTuple):
    """Texels (n,) of a chart and its gutter with their anchors, the nearest points of the chart.

    texels : (n, 2) x and y of the texel
    anchors : (n, 2) x and y of the anchor [texel]
    step_mm : (n, 2) length on the surface of a texel step along x and along y [mm]
    """

    texels: Doubles
    anchors: Doubles
    step_mm: Doubles

    def select(self, indices: Index) -> AnchoredTexels:
        """Return the texels at some indices."""
        return AnchoredTexels._make(part[indices] for part in self)


def unconnected_pairs(surface: FlatSurface, texel_triangle: Ints, axis: int) -> tuple[Index, Index]:
    """Find pairs of adjacent texels that the uv layout does not connect.

    In such a pair, a texel is in a gutter, or the triangles of the two texels share no side in uv.

    Returns two arrays (n,): the flat indices of the first texels, and of the second texels of the pairs.

    texel_triangle : (h, w) triangle to which each texel belongs, -1 in gutters, -2 elsewhere
    axis : 0 for texels adjacent along x, 1 along y
    """
    step = 1 if axis == 0 else texel_triangle.shape[1]
    pair = (
        (texel_triangle[:, :-1], texel_triangle[:, 1:])
        if axis == 0
        else (texel_triangle[:-1], texel_triangle[1:])
    )
    y, x = np.nonzero((np.minimum(*pair) >= -1) & ((pair[0] != pair[1]) | (pair[0] < 0)))
    first = y * texel_triangle.shape[1] + x
    f, g = (texel_triangle.ravel()[texel] for texel in (first, first + step))
    apart = (f < 0) | (g < 0)
    owned = ~apart
    neighbour, g = surface.uv_neighbour[f[owned]].T, g[owned]
    apart[owned] = (neighbour[0] != g) & (neighbour[1] != g) & (neighbour[2] != g)
    return first[apart], first[apart] + step


def anchors_diverge(first_texels: AnchoredTexels, second_texels: AnchoredTexels) -> Mask:
    """Return the mask (n,) of texel pairs whose anchors are far apart.

    The anchor of a texel is the nearest point of its chart. Two anchors are far apart if the distance between
    them is larger than the distance from either texel to its anchor.

    first_texels, second_texels : first and second texel of each of n pairs
    """
    distance2 = np.maximum(
        _squared_length(first_texels.texels - first_texels.anchors),
        _squared_length(second_texels.texels - second_texels.anchors),
    )
    return np.asarray(_squared_length(first_texels.anchors - second_texels.anchors) > distance2)


def gap_limit_mm(first_texels: AnchoredTexels, second_texels: AnchoredTexels, axis: int) -> Doubles:
    """Return how far apart the surface points of two adjacent texels may be without a gap, (n,) [mm].

    If the points are farther apart, the surface does not continue from one texel to the other.

    first_texels, second_texels : first and second texel of each of n adjacent pairs
    axis : 0 for texels adjacent along x, 1 along y
    """
    return (
        _GAP_LIMIT_TEXEL_STEPS * np.maximum(first_texels.step_mm[:, axis], second_texels.step_mm[:, axis])
        + _GAP_SLACK_MM
    )


def _squared_length(vectors: Doubles) -> Doubles:
    """Return the squared length of (n, 2) vectors."""
    return np.asarray(vectors[:, 0] ** 2 + vectors[:, 1] ** 2)
