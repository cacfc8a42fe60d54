"""Geodesics on a triangle mesh: straight lines that continue across edges by unfolding the next triangle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.surface import Adjacency
from dermis.base.arrays import Doubles, Index, Ints, Mask

Complex = NDArray[np.complex128]

START_SHIFT_FRACTION = 1e-3
"""Fraction of the way that start points move towards an inner point of their triangle, to avoid corners."""

INNER_POINT_WEIGHTS = 0.3547, 0.3141, 0.3312
"""Barycentric weights of the inner point to which start points move.

The centroid would let more geodesics hit corners.
"""

_MAX_CROSSED_EDGES = 4096


class Geodesics(NamedTuple):
    """State of the geodesics that have not yet ended.

    Points are complex numbers in the plane of the first triangle of the geodesic; the start is at 0.

    row : index of each geodesic in the arrays of `trace_geodesics`
    triangle : index of the current triangle
    exit_side : side (0, 1, 2) through which the geodesic leaves this triangle
    side_start, side_end : end points of that side
    direction : vector from the start to the target
    orientation : 1, or -1 if the current triangle faces the opposite way to the first triangle
    """

    row: Index
    triangle: Index
    exit_side: Index
    side_start: Complex
    side_end: Complex
    direction: Complex
    orientation: Doubles

    def select(self, mask: Mask) -> Geodesics:
        """Return the geodesics that a mask (n,) selects."""
        return Geodesics._make(part[mask] for part in self)


class GeodesicEnds(NamedTuple):
    """End points of n geodesics on the surface.

    triangle : (n,) index of the triangle that contains the end
    weights : (n, 2) barycentric weights of that triangle's second and third corner
    complete : (n,) mask of geodesics that reached their target before the surface ended
    """

    triangle: Ints
    weights: Doubles
    complete: Mask

    def set_ends(
        self,
        geodesics: Geodesics,
        first_corner: Index,
        second_weight: Doubles,
        third_weight: Doubles,
        reached_target: bool,
    ) -> None:
        """Store the end points of some geodesics.

        geodesics : geodesics that end in their current triangle
        first_corner : corner (0, 1, 2) of the triangle with the weight 1 - second_weight - third_weight
        second_weight, third_weight : weights of the two corners that follow corner `first_corner`
        reached_target : whether the geodesics reached their target
        """
        weights = np.column_stack((1.0 - second_weight - third_weight, second_weight, third_weight))
        order = (np.arange(3) - first_corner[:, None]) % 3
        self.triangle[geodesics.row] = geodesics.triangle
        self.weights[geodesics.row] = np.take_along_axis(weights, order, axis=1)[:, 1:]
        self.complete[geodesics.row] = reached_target


def trace_geodesics(
    adjacency: Adjacency, triangle: NDArray[np.integer], start: Doubles, target: Doubles
) -> GeodesicEnds:
    """Trace a geodesic from a point of each triangle towards a target in the triangle's plane.

    triangle : (n,) index of the first triangle
    start : (n, 2) point in this triangle or on its border, in the triangle's plane [mm]
    target : (n, 2) target in the same plane, usually outside the triangle [mm]
    """
    ends = GeodesicEnds(
        np.array(triangle, np.int32), np.full((len(triangle), 2), 1 / 3), np.zeros(len(triangle), bool)
    )
    geodesics = _leave_first_triangle(
        adjacency, np.asarray(triangle, np.int64), _as_complex(start), _as_complex(target), ends
    )
    for _ in range(_MAX_CROSSED_EDGES):
        if not len(geodesics.row):
            break
        geodesics = _cross_edge(adjacency, geodesics, ends)
    return ends


def _leave_first_triangle(
    adjacency: Adjacency, triangle: Index, start: Complex, target: Complex, ends: GeodesicEnds
) -> Geodesics:
    """Return the geodesics that leave their first triangle; store the end points of all others in `ends`.

    triangle : (n,) index of the first triangle
    start, target : (n,) points in the triangle's plane as complex numbers [mm]
    """
    corners = _as_complex(adjacency.planar_corners[triangle])
    start = start + START_SHIFT_FRACTION * (corners @ np.array(INNER_POINT_WEIGHTS) - start)
    corners, direction = corners - start[:, None], target - start
    after = np.roll(corners, -1, axis=1)
    leaves_through = (_cross(direction[:, None], corners) <= 0.0) & (_cross(direction[:, None], after) >= 0.0)
    leaves_through &= _cross(after - corners, direction[:, None] - corners) < 0.0
    rows, side = np.arange(len(triangle)), leaves_through.argmax(axis=1)
    geodesics = Geodesics(
        rows, triangle, side, corners[rows, side], after[rows, side], direction, np.ones(len(triangle))
    )
    leaves = np.asarray(leaves_through.any(axis=1))
    inside, (a, b, c) = geodesics.select(~leaves), corners[~leaves].T
    ends.set_ends(inside, np.zeros(len(a), np.int64), *_clipped_weights(a, b, c, inside.direction), True)
    return geodesics.select(leaves)


def _cross_edge(adjacency: Adjacency, geodesics: Geodesics, ends: GeodesicEnds) -> Geodesics:
    """Continue geodesics into the next triangle, and return those that leave it again.

    The end points of all others are stored in `ends`.
    """
    neighbour = adjacency.neighbour[geodesics.triangle, geodesics.exit_side]
    ended = (neighbour < 0) | ~adjacency.passable[neighbour]
    if ended.any():
        stopped = geodesics.select(ended)
        ends.set_ends(stopped, stopped.exit_side, _exit_fraction(stopped), np.zeros(len(stopped.row)), False)
        geodesics, neighbour = geodesics.select(~ended), neighbour[~ended]
    neighbour_side = adjacency.neighbour_side[geodesics.triangle, geodesics.exit_side].astype(np.int64)
    flipped = adjacency.flipped[geodesics.triangle, geodesics.exit_side]
    orientation = np.where(flipped, -geodesics.orientation, geodesics.orientation)
    # positions of the corners at both ends of the shared edge, and of the apex, after unfolding
    a, b = (
        np.where(flipped, geodesics.side_start, geodesics.side_end),
        np.where(flipped, geodesics.side_end, geodesics.side_start),
    )
    along, up = adjacency.apex[neighbour, neighbour_side].T
    apex = a + (along + 1j * orientation * up) * (b - a)
    # the geodesic leaves through one of the two edges at the apex
    left, a_left = _cross(geodesics.direction, apex) > 0.0, _cross(geodesics.direction, a) > 0.0
    exits_at_a = left != a_left
    side = (neighbour_side + np.where(exits_at_a, 2, 1)) % 3
    opposite, p, q = np.where(exits_at_a, b, a), np.where(exits_at_a, apex, b), np.where(exits_at_a, a, apex)
    inner = _cross(q - p, opposite - p)
    arrived = (inner != 0.0) & (_cross(q - p, geodesics.direction - p) * inner >= 0.0)
    geodesics = Geodesics(
        geodesics.row, neighbour.astype(np.int64), side, p, q, geodesics.direction, orientation
    )
    done = geodesics.select(arrived)
    weights = _clipped_weights(a[arrived], b[arrived], apex[arrived], done.direction)
    ends.set_ends(done, neighbour_side[arrived], *weights, True)
    return geodesics.select(~arrived)


def _as_complex(points: Doubles) -> Complex:
    """Convert points (..., 2) to complex numbers (...)."""
    return np.ascontiguousarray(points, np.float64).view(np.complex128)[..., 0]


def _cross(first_vector: Complex, second_vector: Complex) -> Doubles:
    return np.asarray(first_vector.real * second_vector.imag - first_vector.imag * second_vector.real)


def _exit_fraction(geodesics: Geodesics) -> Doubles:
    """Return where each geodesic leaves its current triangle, as a position (n,) along the exit side [-].

    The position is 0 at the first end point of this side (`side_start`), and 1 at the second (`side_end`).
    """
    here, there = (
        _cross(geodesics.direction, geodesics.side_start),
        _cross(geodesics.direction, geodesics.side_end),
    )
    return np.clip(here / np.where(here == there, np.inf, here - there), 0.0, 1.0)


def _clipped_weights(
    first_corner: Complex, second_corner: Complex, third_corner: Complex, point: Complex
) -> tuple[Doubles, Doubles]:
    """Return the barycentric weights of the second and third corner at a point, clipped to the triangle."""
    area = _cross(second_corner - first_corner, third_corner - first_corner)
    second_weight = np.clip(_cross(point - first_corner, third_corner - first_corner) / area, 0.0, 1.0)
    third_weight = np.clip(_cross(second_corner - first_corner, point - first_corner) / area, 0.0, 1.0)
    total = np.maximum(second_weight + third_weight, 1.0)
    return second_weight / total, third_weight / total
