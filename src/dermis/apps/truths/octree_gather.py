"""Gathering of light from an octree of triangles, compiled by numba.

Importing this module loads numba, which takes time, so callers import it inside the function that needs it.

Light is gathered at a point of the surface. A node, a triangle or a sub-triangle that is far enough from this
point is replaced by three points with the same flux and nearly the same centroid and second moments. The
error is at most `second_moment` of the node times the curvature of the profile, plus `centroid_error` of the
node times the slope of the profile.
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

_MAX_NESTED_SPLITS = 20
"""Nested splits of a triangle in four; 20 make a side a million times shorter."""


class TriangleStack(NamedTuple):
    """Stack of sub-triangles whose light is still to be gathered.

    corners : (p, 3, 3) corners of the sub-triangles [mm]
    irradiance : (p, 3, 3) irradiance at the corners
    area : (p,) areas of the sub-triangles [mm²]
    """

    corners: Floats
    irradiance: Floats
    area: Floats


@compiled
def gather_exitance(
    points: Floats, octree: Octree, profile_table: ProfileTable, error_bound: float, exitance: Floats
) -> int:
    """Add the exitance at each point to `exitance`; return the number of nodes and triangles visited.

    points : (n, 3) positions [mm]
    error_bound : largest total error, relative to the profile's energy times the irradiance near a point [-]
    exitance : (n, 3) exitance by channel
    """
    size = 3 * _MAX_NESTED_SPLITS + 4
    stack = TriangleStack(np.empty((size, 3, 3)), np.empty((size, 3, 3)), np.empty(size))
    visit_count = 0
    for i in range(len(points)):
        node_index = 0
        while node_index < len(octree.first):
            visit_count += 1
            if _node_is_far(points[i], node_index, octree, profile_table, error_bound):
                _add_node_light(points[i], node_index, octree, profile_table, exitance[i])
                node_index = octree.next_node[node_index]
                continue
            if octree.next_node[node_index] == node_index + 1:
                for t in range(octree.first[node_index], octree.end[node_index]):
                    visit_count += _gather_triangle(
                        points[i], t, octree, profile_table, error_bound, stack, exitance[i]
                    )
            node_index += 1
    return visit_count


@compiled
def _node_is_far(
    point: Floats, node_index: int, octree: Octree, profile_table: ProfileTable, error_bound: float
) -> bool:
    distance = _distance(
        point, octree.centre[node_index, 0], octree.centre[node_index, 1], octree.centre[node_index, 2]
    )
    near, far = _bracketing_rows(distance, octree.radius[node_index], profile_table)
    error = (
        profile_table.curvature[near] * octree.second_moment[node_index]
        + profile_table.slope[near] * octree.centroid_error[node_index]
    )
    return bool(error <= error_bound * profile_table.error_density[far])


@compiled
def _add_node_light(
    point: Floats, node_index: int, octree: Octree, profile_table: ProfileTable, exitance: Floats
) -> None:
    for k in range(3):
        distance = _distance(
            point,
            octree.points[node_index, k, 0],
            octree.points[node_index, k, 1],
            octree.points[node_index, k, 2],
        )
        red, green, blue = (
            octree.flux[node_index, k, 0],
            octree.flux[node_index, k, 1],
            octree.flux[node_index, k, 2],
        )
        _add_flux(distance, red, green, blue, profile_table, exitance)


@compiled
def _gather_triangle(
    point: Floats,
    triangle_index: int,
    octree: Octree,
    profile_table: ProfileTable,
    error_bound: float,
    triangle_stack: TriangleStack,
    exitance: Floats,
) -> int:
    """Add to `exitance` the light that reaches a point from a triangle; return the number of parts visited.

    The triangle is split until the light of each part is approximated well by points at its side midpoints.

    triangle_index : index of the triangle in the octree
    error_bound : largest total error, as in `gather_exitance` [-]
    triangle_stack : working memory for the parts of the triangle; previous content is overwritten
    exitance : (3,) exitance at the point by channel
    """
    triangle_stack.corners[0], triangle_stack.irradiance[0], triangle_stack.area[0] = (
        octree.corners[triangle_index],
        octree.irradiance[triangle_index],
        octree.area[triangle_index],
    )
    count, visit_count = 1, 0
    while count > 0:
        count -= 1
        visit_count += 1
        if _triangle_is_far(
            point, triangle_stack.corners[count], profile_table, error_bound
        ) or count + 4 > len(triangle_stack.area):
            _add_side_midpoints(point, count, triangle_stack, profile_table, exitance)
        else:
            _split_triangle(count, triangle_stack)
            count += 4
    return visit_count


@compiled
def _triangle_is_far(point: Floats, corners: Floats, profile_table: ProfileTable, error_bound: float) -> bool:
    x = (corners[0, 0] + corners[1, 0] + corners[2, 0]) / 3.0
    y = (corners[0, 1] + corners[1, 1] + corners[2, 1]) / 3.0
    z = (corners[0, 2] + corners[1, 2] + corners[2, 2]) / 3.0
    sum_distance2 = max_distance2 = 0.0
    for k in range(3):
        distance2 = (corners[k, 0] - x) ** 2 + (corners[k, 1] - y) ** 2 + (corners[k, 2] - z) ** 2
        sum_distance2 += distance2
        max_distance2 = max(max_distance2, distance2)
    near, far = _bracketing_rows(_distance(point, x, y, z), math.sqrt(max_distance2), profile_table)
    # Upper bound of the mean square distances of linear light and of the midpoints from the centroid.
    second_moment = (sum_distance2 + 2.0 * max_distance2) / 20.0 + max_distance2 / 4.0
    return bool(
        profile_table.curvature[near] * second_moment <= error_bound * profile_table.error_density[far]
    )


@compiled
def _add_side_midpoints(
    point: Floats,
    stack_index: int,
    triangle_stack: TriangleStack,
    profile_table: ProfileTable,
    exitance: Floats,
) -> None:
    """Add to `exitance` the light that reaches a point from one sub-triangle of the stack.

    The flux of the sub-triangle is concentrated at the midpoints of its three sides. This quadrature is exact
    if the product of irradiance and profile is a polynomial of second order.

    point : (3,) position where the light leaves the skin [mm]
    stack_index : index of the sub-triangle in the stack
    exitance : (3,) exitance at the point by channel
    """
    corners, irradiance, scale = (
        triangle_stack.corners[stack_index],
        triangle_stack.irradiance[stack_index],
        triangle_stack.area[stack_index] / 6.0,
    )
    for a in range(3):
        b = (a + 1) % 3
        x = 0.5 * (corners[a, 0] + corners[b, 0])
        y = 0.5 * (corners[a, 1] + corners[b, 1])
        z = 0.5 * (corners[a, 2] + corners[b, 2])
        red = scale * (irradiance[a, 0] + irradiance[b, 0])
        green = scale * (irradiance[a, 1] + irradiance[b, 1])
        blue = scale * (irradiance[a, 2] + irradiance[b, 2])
        _add_flux(_distance(point, x, y, z), red, green, blue, profile_table, exitance)


@compiled
def _split_triangle(stack_index: int, triangle_stack: TriangleStack) -> None:
    """Replace the sub-triangle at `stack_index` by its four quarters, stored from `stack_index` onwards."""
    triangle_stack.area[stack_index : stack_index + 4] = 0.25 * triangle_stack.area[stack_index]
    for values in (triangle_stack.corners, triangle_stack.irradiance):
        for axis in range(3):
            a, b, c = values[stack_index, 0, axis], values[stack_index, 1, axis], values[stack_index, 2, axis]
            ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
            values[stack_index, 0, axis], values[stack_index, 1, axis], values[stack_index, 2, axis] = (
                a,
                ab,
                ca,
            )
            (
                values[stack_index + 1, 0, axis],
                values[stack_index + 1, 1, axis],
                values[stack_index + 1, 2, axis],
            ) = ab, b, bc
            (
                values[stack_index + 2, 0, axis],
                values[stack_index + 2, 1, axis],
                values[stack_index + 2, 2, axis],
            ) = ca, bc, c
            (
                values[stack_index + 3, 0, axis],
                values[stack_index + 3, 1, axis],
                values[stack_index + 3, 2, axis],
            ) = ab, bc, ca


@compiled
def _distance(point: Floats, x: float, y: float, z: float) -> float:
    return math.sqrt((x - point[0]) ** 2 + (y - point[1]) ** 2 + (z - point[2]) ** 2)


@compiled
def _bracketing_rows(distance: float, ball_radius: float, profile_table: ProfileTable) -> tuple[int, int]:
    """Return the rows of the profile's table that bracket the distances of all points of a ball.

    distance : distance of the ball's centre from the point at which light is gathered [mm]
    ball_radius : radius of the ball [mm]
    """
    last = len(profile_table.error_density) - 1
    near = int(math.sqrt(max(distance - ball_radius, 0.0)) * profile_table.rows_per_root)
    far = int(math.sqrt(distance + ball_radius) * profile_table.rows_per_root) + 1
    return min(near, last), min(far, last)


@compiled
def _add_flux(
    distance: float,
    red_flux: float,
    green_flux: float,
    blue_flux: float,
    profile_table: ProfileTable,
    exitance: Floats,
) -> None:
    """Add to `exitance`, for each channel, the flux times the profile interpolated at a distance."""
    row_position = math.sqrt(distance) * profile_table.rows_per_root
    row = int(row_position)
    if row < len(profile_table.R) - 1:
        fraction = row_position - row
        exitance[0] += red_flux * (
            profile_table.R[row, 0] + fraction * (profile_table.R[row + 1, 0] - profile_table.R[row, 0])
        )
        exitance[1] += green_flux * (
            profile_table.R[row, 1] + fraction * (profile_table.R[row + 1, 1] - profile_table.R[row, 1])
        )
        exitance[2] += blue_flux * (
            profile_table.R[row, 2] + fraction * (profile_table.R[row + 1, 2] - profile_table.R[row, 2])
        )
