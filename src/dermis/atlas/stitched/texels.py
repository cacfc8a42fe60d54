"""What texels show, and how far runs of texels go without a gap on the surface."""

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

_STEPS, _SLACK_MM = 2.0, 0.5  # neighbours farther apart than so many steps plus the slack have a gap
_WELL = 1e-3  # texels this far from an edge are on no other triangle that only shares it


def rasterise_owners(places: Doubles, triangles: Index, shape: tuple[int, int]) -> NDArray[np.int32]:
    """(h, w) the last triangle in which each texel's centre lies, -1 for none.

    places : (f, 3, 2) corners [texel]
    triangles : those to be drawn
    """
    owner = np.full(shape, -1, np.int32)
    texel, which = covered_texels(places[triangles], shape)
    owner.ravel()[texel] = triangles[which]
    return owner


def mostly_hidden(places: Doubles, triangles: Index, owner: NDArray[np.int32]) -> Flags:
    """Triangles (f,) most of whose texels are owned by others; arguments as for `rasterise_owners`."""
    texel, which = covered_texels(places[triangles], owner.shape, _WELL)
    drawn, count = triangles[which], len(places)
    owned = np.bincount(drawn[owner.ravel()[texel] == drawn], minlength=count)
    return np.asarray(owned < 0.5 * np.bincount(drawn, minlength=count))


def centre_weights(places: Doubles, owner: NDArray[np.int32]) -> Singles:
    """(h, w, 2) of the second and third corner at the centre of each texel that has an owner."""
    y, x = np.nonzero(owner >= 0)
    weights = np.zeros((*owner.shape, 2), np.float32)
    weights[y, x] = barycentric_weights(places[owner[y, x]], np.column_stack((x, y)))
    return weights


def barycentric_weights(corners: Doubles, at: NDArray[Any]) -> Doubles:
    """(n, 2) of the second and third corner of triangles (n, 3, 2) at places (n, 2) in them [texel]."""
    e1, e2, off = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], at - corners[:, 0]
    area = cross_2d(e1, e2)
    area = np.where(area == 0, 1.0, area)
    second, third = np.clip(cross_2d(off, e2) / area, 0.0, 1.0), np.clip(cross_2d(e1, off) / area, 0.0, 1.0)
    return np.stack((second, third), axis=1) / np.maximum(second + third, 1.0)[:, None]


class AnchoredTexels(NamedTuple):
    """Texels (n,) and the places of their piece that they belong to.

    texels : (n, 2) x and y
    roots : (n, 2) nearest places of the piece [texel]
    step_mm : (n, 2) length on the surface of a texel along x and y
    """

    texels: Doubles
    roots: Doubles
    step_mm: Doubles

    def select(self, chosen: Index) -> AnchoredTexels:
        """Some of them."""
        return AnchoredTexels._make(part[chosen] for part in self)


def unconnected_pairs(surface: FlatSurface, owner: NDArray[np.int32], axis: int) -> tuple[Index, Index]:
    """Flat indices of texels beside each other along x (0) or y (1) that no triangles join.

    owner : (h, w) triangles of a piece, -1 in its gutters, -2 where nothing is
    """
    ahead = 1 if axis == 0 else owner.shape[1]
    pair = (owner[:, :-1], owner[:, 1:]) if axis == 0 else (owner[:-1], owner[1:])
    y, x = np.nonzero((np.minimum(*pair) >= -1) & ((pair[0] != pair[1]) | (pair[0] < 0)))
    first = y * owner.shape[1] + x
    f, g = (owner.ravel()[texel] for texel in (first, first + ahead))
    apart = (f < 0) | (g < 0)
    owned = ~apart
    neighbour, g = surface.uv_neighbour[f[owned]].T, g[owned]
    apart[owned] = (neighbour[0] != g) & (neighbour[1] != g) & (neighbour[2] != g)
    return first[apart], first[apart] + ahead


def anchors_diverge(one: AnchoredTexels, other: AnchoredTexels) -> Flags:
    """Whether the roots of two texels are farther apart than either texel is from its root."""
    away2 = np.maximum(_square(one.texels - one.roots), _square(other.texels - other.roots))
    return np.asarray(_square(one.roots - other.roots) > away2)


def gap_mm(one: AnchoredTexels, other: AnchoredTexels, axis: int) -> Doubles:
    """Distance (n,) on the surface from which texels beside each other have a gap between them."""
    return _STEPS * np.maximum(one.step_mm[:, axis], other.step_mm[:, axis]) + _SLACK_MM


def _square(off: Doubles) -> Doubles:
    """Squared length of (n, 2) vectors."""
    return np.asarray(off[:, 0] ** 2 + off[:, 1] ** 2)


def run_lengths(joined: Flags) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """(h, w) how many texels of each row are joined before each, and after it.

    joined : (h, w) whether each goes on where the one before it ends
    """
    after = np.zeros_like(joined)
    after[:, :-1] = joined[:, 1:]
    return _before(joined), _before(after[:, ::-1])[:, ::-1]


def _before(joined: Flags) -> NDArray[np.int32]:
    index = np.arange(joined.shape[1], dtype=np.int32)
    return index - np.maximum.accumulate(np.where(joined, 0, index), axis=1)
