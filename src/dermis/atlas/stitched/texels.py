"""Texels of triangles, and runs of texels without a gap on the surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.atlas.raster import barycentric_weights, covered_texels
from dermis.atlas.stitched.surface import FlatSurface
from dermis.base.arrays import Doubles, Floats, Index, Ints, Mask

_GAP_STEPS, _GAP_SLACK_MM = (
    2.0,
    0.5,
)  # neighbours farther apart than so many texel steps plus the slack have a gap
_INNER_MARGIN = 1e-3  # texel centres this far from an edge are in no other triangle at this edge


def rasterise_owners(corners: Doubles, triangles: Index, shape: tuple[int, int]) -> Ints:
    """Return the last triangle that covers the centre of each texel (h, w), -1 for none.

    corners : (f, 3, 2) [texel]
    triangles : triangles in drawing order
    """
    owner = np.full(shape, -1, np.int32)
    texel, which = covered_texels(corners[triangles], shape)
    owner.ravel()[texel] = triangles[which]
    return owner


def mostly_hidden(corners: Doubles, triangles: Index, owner: Ints) -> Mask:
    """Return the mask (f,) of triangles whose texels mostly belong to others; see `rasterise_owners`."""
    texel, which = covered_texels(corners[triangles], owner.shape, _INNER_MARGIN)
    drawn, count = triangles[which], len(corners)
    owned = np.bincount(drawn[owner.ravel()[texel] == drawn], minlength=count)
    return np.asarray(owned < 0.5 * np.bincount(drawn, minlength=count))


def centre_weights(corners: Doubles, owner: Ints) -> Floats:
    """Return the weights (h, w, 2) of the second and third corner at the centre of each covered texel."""
    y, x = np.nonzero(owner >= 0)
    weights = np.zeros((*owner.shape, 2), np.float32)
    weights[y, x] = barycentric_weights(corners[owner[y, x]], np.column_stack((x, y)))
    return weights


class AnchoredTexels(NamedTuple):
    """Texels (n,) and their anchors, the nearest points of their piece.

    texels : (n, 2) x and y
    anchors : (n, 2) [texel]
    step_mm : (n, 2) length of a texel step along x and y on the surface
    """

    texels: Doubles
    anchors: Doubles
    step_mm: Doubles

    def select(self, chosen: Index) -> AnchoredTexels:
        """Return the chosen texels."""
        return AnchoredTexels._make(part[chosen] for part in self)


def unconnected_pairs(surface: FlatSurface, owner: Ints, axis: int) -> tuple[Index, Index]:
    """Return flat indices of texels adjacent along x (0) or y (1) whose triangles share no side.

    owner : (h, w) triangle of a piece, -1 in its gutters, -2 elsewhere
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


def anchors_diverge(one: AnchoredTexels, other: AnchoredTexels) -> Mask:
    """Return whether the anchors of two texels are farther apart than either texel is from its anchor."""
    distance2 = np.maximum(_square(one.texels - one.anchors), _square(other.texels - other.anchors))
    return np.asarray(_square(one.anchors - other.anchors) > distance2)


def gap_limit_mm(one: AnchoredTexels, other: AnchoredTexels, axis: int) -> Doubles:
    """Return the distance (n,) on the surface above which there is a gap between adjacent texels [mm]."""
    return _GAP_STEPS * np.maximum(one.step_mm[:, axis], other.step_mm[:, axis]) + _GAP_SLACK_MM


def _square(offset: Doubles) -> Doubles:
    """Return the squared length of (n, 2) vectors."""
    return np.asarray(offset[:, 0] ** 2 + offset[:, 1] ** 2)
