"""Rasterised triangles, and tests whether adjacent texels are also adjacent on the surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.atlas.raster import barycentric_weights, covered_texels
from dermis.atlas.stitched.surface import FlatSurface
from dermis.base.arrays import Doubles, Floats, Index, Ints, Mask

# There is a gap between texels whose surface points are farther apart than this many steps plus the slack.
_GAP_STEPS, _GAP_SLACK_MM = 2.0, 0.5
_INNER_MARGIN = 1e-3  # texel centres this far inside an edge are not in the triangle across it [texel]


def rasterise_owners(corners: Doubles, triangles: Index, shape: tuple[int, int]) -> Ints:
    """Draw triangles; return for each texel centre (h, w) the last triangle that covers it, -1 without any.

    corners : (f, 3, 2) corners of all triangles [texel]
    triangles : (t,) indices in drawing order
    """
    owner = np.full(shape, -1, np.int32)
    texel, which = covered_texels(corners[triangles], shape)
    owner.ravel()[texel] = triangles[which]
    return owner


def mostly_hidden(corners: Doubles, triangles: Index, owner: Ints) -> Mask:
    """Return the mask (f,) of triangles most of whose texels are owned by other triangles.

    corners : (f, 3, 2) corners of all triangles [texel]
    triangles : (t,) indices of the drawn triangles
    owner : (h, w) triangle that owns each texel, from `rasterise_owners`
    """
    texel, which = covered_texels(corners[triangles], owner.shape, _INNER_MARGIN)
    drawn, count = triangles[which], len(corners)
    owned = np.bincount(drawn[owner.ravel()[texel] == drawn], minlength=count)
    return np.asarray(owned < 0.5 * np.bincount(drawn, minlength=count))


def centre_weights(corners: Doubles, owner: Ints) -> Floats:
    """Return the barycentric weights (h, w, 2) of the second and third corner at each texel centre.

    corners : (f, 3, 2) corners of all triangles [texel]
    owner : (h, w) triangle that owns each texel, -1 if there is none
    """
    y, x = np.nonzero(owner >= 0)
    weights = np.zeros((*owner.shape, 2), np.float32)
    weights[y, x] = barycentric_weights(corners[owner[y, x]], np.column_stack((x, y)))
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


def unconnected_pairs(surface: FlatSurface, owner: Ints, axis: int) -> tuple[Index, Index]:
    """Return the flat indices (n,) of both texels of each adjacent pair whose triangles share no side in uv.

    owner : (h, w) triangle that owns the texel, -1 in gutters, -2 elsewhere
    axis : 0 for texels adjacent along x, 1 along y
    """
    step = 1 if axis == 0 else owner.shape[1]
    pair = (owner[:, :-1], owner[:, 1:]) if axis == 0 else (owner[:-1], owner[1:])
    y, x = np.nonzero((np.minimum(*pair) >= -1) & ((pair[0] != pair[1]) | (pair[0] < 0)))
    first = y * owner.shape[1] + x
    f, g = (owner.ravel()[texel] for texel in (first, first + step))
    apart = (f < 0) | (g < 0)
    owned = ~apart
    neighbour, g = surface.uv_neighbour[f[owned]].T, g[owned]
    apart[owned] = (neighbour[0] != g) & (neighbour[1] != g) & (neighbour[2] != g)
    return first[apart], first[apart] + step


def anchors_diverge(first: AnchoredTexels, second: AnchoredTexels) -> Mask:
    """Return the mask of texel pairs whose anchors are farther apart than either texel is from its anchor.

    The anchor of a texel is the nearest point of its chart.
    """
    distance2 = np.maximum(
        _squared_length(first.texels - first.anchors), _squared_length(second.texels - second.anchors)
    )
    return np.asarray(_squared_length(first.anchors - second.anchors) > distance2)


def gap_limit_mm(first: AnchoredTexels, second: AnchoredTexels, axis: int) -> Doubles:
    """Return the largest distance (n,) between the surface points of adjacent texels without a gap [mm].

    axis : 0 for texels adjacent along x, 1 along y
    """
    return _GAP_STEPS * np.maximum(first.step_mm[:, axis], second.step_mm[:, axis]) + _GAP_SLACK_MM


def _squared_length(offset: Doubles) -> Doubles:
    """Return the squared length of (n, 2) vectors."""
    return np.asarray(offset[:, 0] ** 2 + offset[:, 1] ** 2)
