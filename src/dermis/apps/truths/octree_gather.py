"""Gathering light from an octree of triangles, compiled by numba: import this inside functions.

A node, a triangle or a part of one that is far enough is replaced by three points with the same flux and
nearly the same centre and second moments. The error is at most its `spread` times the profile's curvature,
plus its `offset` times the slope.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.octree import Octree
from dermis.apps.truths.radial_table import ProfileTable
from dermis.base.compiled import compiled

Floats = NDArray[np.float64]

_MAX_SUBDIVISIONS = 20
"""Nested cuts of a triangle in four; 20 make a side a million times shorter."""


class TriangleStack(NamedTuple):
    """A stack of parts of a triangle: corners (p, 3, 3) [mm], light at them (p, 3, 3), area (p,) [mm²]."""

    corners: Floats
    light: Floats
    area: Floats


@compiled
def gather_exitance(points: Floats, tree: Octree, table: ProfileTable, bound: float, exitance: Floats) -> int:
    """Add the light that leaves at each point (n, 3) to exitance (n, 3); returns how many parts were visited.

    bound : of the sum of all errors, over the profile's energy times the irradiance nearby [-]
    """
    size = 3 * _MAX_SUBDIVISIONS + 4
    pending = TriangleStack(np.empty((size, 3, 3)), np.empty((size, 3, 3)), np.empty(size))
    visits = 0
    for i in range(len(points)):
        node = 0
        while node < len(tree.first):
            visits += 1
            if _node_is_far(points[i], node, tree, table, bound):
                _add_node(points[i], node, tree, table, exitance[i])
                node = tree.skip[node]
                continue
            if tree.skip[node] == node + 1:
                for t in range(tree.first[node], tree.end[node]):
                    visits += _gather_triangle(points[i], t, tree, table, bound, pending, exitance[i])
            node += 1
    return visits


@compiled
def _node_is_far(point: Floats, node: int, tree: Octree, table: ProfileTable, bound: float) -> bool:
    distance = _distance(point, tree.centre[node, 0], tree.centre[node, 1], tree.centre[node, 2])
    near, far = _table_rows(distance, tree.radius[node], table)
    remainder = table.curvature[near] * tree.spread[node] + table.slope[near] * tree.offset[node]
    return bool(remainder <= bound * table.share[far])


@compiled
def _add_node(point: Floats, node: int, tree: Octree, table: ProfileTable, exitance: Floats) -> None:
    for k in range(3):
        distance = _distance(point, tree.places[node, k, 0], tree.places[node, k, 1], tree.places[node, k, 2])
        red, green, blue = tree.flux[node, k, 0], tree.flux[node, k, 1], tree.flux[node, k, 2]
        _add_flux(distance, red, green, blue, table, exitance)


@compiled
def _gather_triangle(
    point: Floats, t: int, tree: Octree, table: ProfileTable, bound: float, pending: TriangleStack, exitance: Floats
) -> int:
    """Add a triangle's light, cut in four until its parts are far enough; returns how many were visited."""
    pending.corners[0], pending.light[0], pending.area[0] = tree.corners[t], tree.light[t], tree.area[t]
    count, visits = 1, 0
    while count > 0:
        count -= 1
        visits += 1
        if _triangle_is_far(point, pending.corners[count], table, bound) or count + 4 > len(pending.area):
            _add_midpoints(point, count, pending, table, exitance)
        else:
            _split_triangle(count, pending)
            count += 4
    return visits


@compiled
def _triangle_is_far(point: Floats, corners: Floats, table: ProfileTable, bound: float) -> bool:
    x = (corners[0, 0] + corners[1, 0] + corners[2, 0]) / 3.0
    y = (corners[0, 1] + corners[1, 1] + corners[2, 1]) / 3.0
    z = (corners[0, 2] + corners[1, 2] + corners[2, 2]) / 3.0
    total = largest = 0.0
    for k in range(3):
        square = (corners[k, 0] - x) ** 2 + (corners[k, 1] - y) ** 2 + (corners[k, 2] - z) ** 2
        total += square
        largest = max(largest, square)
    near, far = _table_rows(_distance(point, x, y, z), math.sqrt(largest), table)
    # At most the mean square distance from the middle, of linear light and of the midpoints of the sides.
    spread = (total + 2.0 * largest) / 20.0 + largest / 4.0
    return bool(table.curvature[near] * spread <= bound * table.share[far])


@compiled
def _add_midpoints(point: Floats, i: int, pending: TriangleStack, table: ProfileTable, exitance: Floats) -> None:
    """Add the midpoints of the sides: right for light times profile up to second order."""
    corners, light, scale = pending.corners[i], pending.light[i], pending.area[i] / 6.0
    for a in range(3):
        b = (a + 1) % 3
        x = 0.5 * (corners[a, 0] + corners[b, 0])
        y = 0.5 * (corners[a, 1] + corners[b, 1])
        z = 0.5 * (corners[a, 2] + corners[b, 2])
        red, green, blue = light[a, 0] + light[b, 0], light[a, 1] + light[b, 1], light[a, 2] + light[b, 2]
        _add_flux(_distance(point, x, y, z), scale * red, scale * green, scale * blue, table, exitance)


@compiled
def _split_triangle(i: int, pending: TriangleStack) -> None:
    """Replace part i by its four quarters, i to i + 3."""
    pending.area[i : i + 4] = 0.25 * pending.area[i]
    for values in (pending.corners, pending.light):
        for axis in range(3):
            a, b, c = values[i, 0, axis], values[i, 1, axis], values[i, 2, axis]
            ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
            values[i, 0, axis], values[i, 1, axis], values[i, 2, axis] = a, ab, ca
            values[i + 1, 0, axis], values[i + 1, 1, axis], values[i + 1, 2, axis] = ab, b, bc
            values[i + 2, 0, axis], values[i + 2, 1, axis], values[i + 2, 2, axis] = ca, bc, c
            values[i + 3, 0, axis], values[i + 3, 1, axis], values[i + 3, 2, axis] = ab, bc, ca


@compiled
def _distance(point: Floats, x: float, y: float, z: float) -> float:
    return math.sqrt((x - point[0]) ** 2 + (y - point[1]) ** 2 + (z - point[2]) ** 2)


@compiled
def _table_rows(distance: float, radius: float, table: ProfileTable) -> tuple[int, int]:
    """Rows of the table at or before the nearest and at or after the furthest point within a radius."""
    last = len(table.share) - 1
    near = int(math.sqrt(max(distance - radius, 0.0)) * table.per_root)
    far = int(math.sqrt(distance + radius) * table.per_root) + 1
    return min(near, last), min(far, last)


@compiled
def _add_flux(distance: float, red: float, green: float, blue: float, table: ProfileTable, exitance: Floats) -> None:
    """Add flux times the profile, interpolated in the table."""
    at = math.sqrt(distance) * table.per_root
    row = int(at)
    if row < len(table.R) - 1:
        part = at - row
        exitance[0] += red * (table.R[row, 0] + part * (table.R[row + 1, 0] - table.R[row, 0]))
        exitance[1] += green * (table.R[row, 1] + part * (table.R[row + 1, 1] - table.R[row, 1]))
        exitance[2] += blue * (table.R[row, 2] + part * (table.R[row + 1, 2] - table.R[row, 2]))
