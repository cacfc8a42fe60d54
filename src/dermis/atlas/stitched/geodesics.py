"""Straight walks over a surface, from triangle to triangle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.surface import Adjacency

Doubles = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]

START_SHIFT = 1e-3
"""Of the way to a place inside the triangle: so that a walk from a corner starts inside."""

INNER_WEIGHTS = 0.3547, 0.3141, 0.3312
"""Weights of that place: from the very middle, walks meet corners more often."""

_MOST_STEPS = 4096


class Geodesics(NamedTuple):
    """Those who still walk; places are complex numbers in the plane of the first triangle, 0 is the start.

    number : which walk it is
    triangle, side : where they are, and the side that they leave it through
    a, b : its ends
    way : from the start to the target
    hand : 1, or -1 in triangles that face the other way than the first
    """

    number: Index
    triangle: Index
    side: Index
    a: Complex
    b: Complex
    way: Complex
    hand: Doubles

    def select(self, chosen: Flags) -> Geodesics:
        """Some of them."""
        return Geodesics._make(part[chosen] for part in self)


class GeodesicEnds(NamedTuple):
    """Where walks (n,) end.

    triangle : there
    weights : (n, 2) of its second and third corner
    whole : whether the target was reached before the surface ended
    """

    triangle: NDArray[np.int32]
    weights: Doubles
    complete: Flags

    def write(self, who: Geodesics, first: Index, b: Doubles, c: Doubles, complete: bool) -> None:
        """The end of some walks: weights of the corners after the corner `first` of their triangle."""
        three = np.column_stack((1.0 - b - c, b, c))
        places = (np.arange(3) - first[:, None]) % 3
        self.triangle[who.number] = who.triangle
        self.weights[who.number] = np.take_along_axis(three, places, axis=1)[:, 1:]
        self.complete[who.number] = complete


def trace_geodesics(adjacency: Adjacency, triangle: NDArray[np.integer], start: Doubles, target: Doubles) -> GeodesicEnds:
    """Walk straight from a place in each triangle to a target in its plane, unfolding triangles on the way.

    triangle : (n,)
    start : (n, 2) in the triangle or on its border [mm]
    target : (n, 2) [mm]
    """
    ends = GeodesicEnds(
        np.array(triangle, np.int32), np.full((len(triangle), 2), 1 / 3), np.zeros(len(triangle), bool)
    )
    who = _begin(adjacency, np.asarray(triangle, np.int64), _complex(start), _complex(target), ends)
    for _ in range(_MOST_STEPS):
        if not len(who.number):
            break
        who = _step(adjacency, who, ends)
    return ends


def _begin(adjacency: Adjacency, triangle: Index, start: Complex, target: Complex, ends: GeodesicEnds) -> Geodesics:
    """Those who leave their first triangle, and the ends of the others."""
    corners = _complex(adjacency.flat[triangle])
    start = start + START_SHIFT * (corners @ np.array(INNER_WEIGHTS) - start)
    corners, way = corners - start[:, None], target - start
    after = np.roll(corners, -1, axis=1)
    passes = (_cross(way[:, None], corners) <= 0.0) & (_cross(way[:, None], after) >= 0.0)
    passes &= _cross(after - corners, way[:, None] - corners) < 0.0
    rows, side = np.arange(len(triangle)), passes.argmax(axis=1)
    all_of_them = Geodesics(
        rows, triangle, side, corners[rows, side], after[rows, side], way, np.ones(len(triangle))
    )
    leaves = np.asarray(passes.any(axis=1))
    stay, (a, b, c) = all_of_them.select(~leaves), corners[~leaves].T
    ends.write(stay, np.zeros(len(a), np.int64), *_weights(a, b, c, stay.way), True)
    return all_of_them.select(leaves)


def _step(adjacency: Adjacency, who: Geodesics, ends: GeodesicEnds) -> Geodesics:
    """Into the next triangle: those who walk on from there, and the ends of the others."""
    neighbour = adjacency.neighbour[who.triangle, who.side]
    ended = (neighbour < 0) | ~adjacency.passable[neighbour]
    if ended.any():
        stopped = who.select(ended)
        ends.write(stopped, stopped.side, _met(stopped), np.zeros(len(stopped.number)), False)
        who, neighbour = who.select(~ended), neighbour[~ended]
    neighbour_side = adjacency.neighbour_side[who.triangle, who.side].astype(np.int64)
    flipped = adjacency.flipped[who.triangle, who.side]
    hand = np.where(flipped, -who.hand, who.hand)
    # where the corners `neighbour_side` and `neighbour_side` + 1 of the next triangle come to lie, and its apex
    a, b = np.where(flipped, who.a, who.b), np.where(flipped, who.b, who.a)
    forth, up = adjacency.apex[neighbour, neighbour_side].T
    apex = a + (forth + 1j * hand * up) * (b - a)
    # it leaves between the apex and the end on the other side
    left, a_left = _cross(who.way, apex) > 0.0, _cross(who.way, a) > 0.0
    by_a = left != a_left
    side = (neighbour_side + np.where(by_a, 2, 1)) % 3
    off, p, q = np.where(by_a, b, a), np.where(by_a, apex, b), np.where(by_a, a, apex)
    inner = _cross(q - p, off - p)
    arrived = (inner != 0.0) & (_cross(q - p, who.way - p) * inner >= 0.0)
    who = Geodesics(who.number, neighbour.astype(np.int64), side, p, q, who.way, hand)
    there = who.select(arrived)
    found = _weights(a[arrived], b[arrived], apex[arrived], there.way)
    ends.write(there, neighbour_side[arrived], *found, True)
    return who.select(~arrived)


def _complex(places: Doubles) -> Complex:
    """(...) numbers of (..., 2) places."""
    return np.ascontiguousarray(places, np.float64).view(np.complex128)[..., 0]


def _cross(a: Complex, b: Complex) -> Doubles:
    return np.asarray(a.real * b.imag - a.imag * b.real)


def _met(who: Geodesics) -> Doubles:
    """How far along the side from a to b the way meets it, 0 to 1."""
    here, there = _cross(who.way, who.a), _cross(who.way, who.b)
    return np.clip(here / np.where(here == there, np.inf, here - there), 0.0, 1.0)


def _weights(a: Complex, b: Complex, c: Complex, at: Complex) -> tuple[Doubles, Doubles]:
    """Barycentric weights of b and c, none negative."""
    area = _cross(b - a, c - a)
    second = np.clip(_cross(at - a, c - a) / area, 0.0, 1.0)
    third = np.clip(_cross(b - a, at - a) / area, 0.0, 1.0)
    total = np.maximum(second + third, 1.0)
    return second / total, third / total
