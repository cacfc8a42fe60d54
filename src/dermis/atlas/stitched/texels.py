"""Texels of triangles, and runs of texels without a gap on the surface."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.raster import covered_texels, cross_2d
from dermis.atlas.stitched.surface import FlatSurface

Doubles = NDArray[np.float64]
Singles = NDArray[np.float32]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]

_GAP_STEPS, _GAP_SLACK_MM = (
    2.0,
    0.5,
)  # neighbours farther apart than so many texel steps plus the slack have a gap
_INNER_MARGIN = 1e-3  # texel centres this far from an edge are in no other triangle at this edge


def rasterise_owners(corners: Doubles, triangles: Index, shape: tuple[int, int]) -> NDArray[np.int32]:
    """Return the last triangle that covers the centre of each texel (h, w), -1 for none.

    corners : (f, 3, 2) [texel]
    triangles : triangles in drawing order
    """
    owner = np.full(shape, -1, np.int32)
    texel, which = covered_texels(corners[triangles], shape)
    owner.ravel()[texel] = triangles[which]
    return owner


def mostly_hidden(corners: Doubles, triangles: Index, owner: NDArray[np.int32]) -> Flags:
    """Return the mask (f,) of triangles whose texels mostly belong to others; see `rasterise_owners`."""
    texel, which = covered_texels(corners[triangles], owner.shape, _INNER_MARGIN)
    drawn, count = triangles[which], len(corners)
    owned = np.bincount(drawn[owner.ravel()[texel] == drawn], minlength=count)
    return np.asarray(owned < 0.5 * np.bincount(drawn, minlength=count))


def centre_weights(corners: Doubles, owner: NDArray[np.int32]) -> Singles:
    """Return the weights (h, w, 2) of the second and third corner at the centre of each covered texel."""
    y, x = np.nonzero(owner >= 0)
    weights = np.zeros((*owner.shape, 2), np.float32)
    weights[y, x] = barycentric_weights(corners[owner[y, x]], np.column_stack((x, y)))
    return weights


def barycentric_weights(corners: Doubles, points: NDArray[Any]) -> Doubles:
    """Return the weights (n, 2) of the second and third corner at points of triangles.

    corners : (n, 3, 2) [texel]
    points : (n, 2) [texel]
    """
    e1, e2, offset = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    area = cross_2d(e1, e2)
    area = np.where(area == 0, 1.0, area)
    second, third = (
        np.clip(cross_2d(offset, e2) / area, 0.0, 1.0),
        np.clip(cross_2d(e1, offset) / area, 0.0, 1.0),
    )
    return np.stack((second, third), axis=1) / np.maximum(second + third, 1.0)[:, None]


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


def unconnected_pairs(surface: FlatSurface, owner: NDArray[np.int32], axis: int) -> tuple[Index, Index]:
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


def anchors_diverge(one: AnchoredTexels, other: AnchoredTexels) -> Flags:
    """Return whether the anchors of two texels are farther apart than either texel is from its anchor."""
    distance2 = np.maximum(_square(one.texels - one.anchors), _square(other.texels - other.anchors))
    return np.asarray(_square(one.anchors - other.anchors) > distance2)


def gap_limit_mm(one: AnchoredTexels, other: AnchoredTexels, axis: int) -> Doubles:
    """Return the distance (n,) on the surface above which there is a gap between adjacent texels [mm]."""
    return _GAP_STEPS * np.maximum(one.step_mm[:, axis], other.step_mm[:, axis]) + _GAP_SLACK_MM


def _square(offset: Doubles) -> Doubles:
    """Return the squared length of (n, 2) vectors."""
    return np.asarray(offset[:, 0] ** 2 + offset[:, 1] ** 2)


def run_lengths(joined: Flags) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the number of connected texels before and after each texel of a row (h, w).

    joined : (h, w) whether each texel is connected to the one before it
    """
    after = np.zeros_like(joined)
    after[:, :-1] = joined[:, 1:]
    return _run_before(joined), _run_before(after[:, ::-1])[:, ::-1]


def _run_before(joined: Flags) -> NDArray[np.int32]:
    index = np.arange(joined.shape[1], dtype=np.int32)
    return index - np.maximum.accumulate(np.where(joined, 0, index), axis=1)
