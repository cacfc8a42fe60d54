"""Implicit shapes: signed distances in mm, negative inside, and the smooth ways to join them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

Doubles = NDArray[np.float64]
Field = Callable[[Doubles], Doubles]
"""Distance (n,) [mm] of points (n, 3) [mm]."""
_TETRAHEDRON = np.array([[1.0, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]])


def smooth_union(a: Doubles, b: Doubles, radius: float | Doubles) -> Doubles:
    """The lesser of two distances, rounded with a C2 fillet where they differ by less than `radius` [mm]."""
    h = np.maximum(radius - np.abs(a - b), 0.0) / radius
    return np.minimum(a, b) - h * h * h * (radius / 6)


def smooth_intersection(a: Doubles, b: Doubles, radius: float) -> Doubles:
    """What lies in both shapes, with rounded edges."""
    return -smooth_union(-a, -b, radius)


def smooth_difference(a: Doubles, b: Doubles, radius: float) -> Doubles:
    """Shape `a` with `b` carved out of it."""
    return -smooth_union(-a, b, radius)


def ellipsoid(points: Doubles, centre: ArrayLike, radii: ArrayLike, axes: Doubles | None = None) -> Doubles:
    """About the distance to an ellipsoid; its axes are the rows of `axes` (3, 3), else x, y and z."""
    local = points - np.asarray(centre)
    if axes is not None:
        local = local @ axes.T
    radii = np.asarray(radii)
    scaled = local / radii
    reach = np.sqrt(np.einsum("ni,ni->n", scaled, scaled)) + 1e-9
    slope = np.sqrt(np.einsum("ni,ni->n", scaled / radii, scaled / radii)) + 1e-9
    return np.asarray(reach * (reach - 1) / slope)


def cone(points: Doubles, start: ArrayLike, end: ArrayLike, radius: float, end_radius: float) -> Doubles:
    """Distance to a round rod whose radius changes from one end to the other."""
    first = np.asarray(start, dtype=np.float64)
    along = np.asarray(end, dtype=np.float64) - first
    local = points - first
    t = np.clip(local @ along / (along @ along), 0, 1)
    away = local - t[:, None] * along
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", away, away)) - (radius + (end_radius - radius) * t))


def tube(points: Doubles, knots: ArrayLike, pieces: int = 4) -> Doubles:
    """Distance to a rod bent through knots, rows of x, y, z, radius [mm].

    pieces : straight pieces from knot to knot
    """
    distance = np.full(len(points), np.inf)
    rows = spline(knots, pieces)
    for a, b in pairwise(rows):
        distance = np.minimum(distance, cone(points, a[:3], b[:3], a[3], b[3]))
    return distance


def spline(knots: ArrayLike, pieces: int, closed: bool = False) -> Doubles:
    """Points (n, k) on the smooth curve through knots (m, k), `pieces` from knot to knot."""
    from scipy.interpolate import CubicSpline

    rows = np.asarray(knots, dtype=np.float64)
    if closed:
        rows = np.vstack((rows, rows[:1]))
    place = np.arange(len(rows))
    curve = CubicSpline(place, rows, bc_type="periodic" if closed else "not-a-knot")
    return np.asarray(curve(np.linspace(0, len(rows) - 1, pieces * (len(rows) - 1) + 1)))


def bump(points: Doubles, centre: ArrayLike, radii: ArrayLike) -> Doubles:
    """A soft spot, 1 at its centre and exp(-1) at its radii."""
    scaled = (points - np.asarray(centre)) / np.asarray(radii)
    return np.asarray(np.exp(-np.einsum("ni,ni->n", scaled, scaled)))


def rise(values: Doubles, low: float, high: float) -> Doubles:
    """From 0 at `low` to 1 at `high` with level ends; downwards when `low` is the greater."""
    t: Doubles = np.clip((values - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def gradient(field: Field, points: Doubles, step: float | Doubles = 0.05) -> Doubles:
    """Gradient (n, 3) of a field from the corners of a tetrahedron, `step` from the point along each axis.

    step : one for all or one for each point (n,) [mm]
    """
    steps = np.broadcast_to(step, len(points))
    corners = points + _TETRAHEDRON[:, None] * steps[:, None]
    values = field(corners.reshape(-1, 3)).reshape(4, -1)
    return np.asarray((values.T @ _TETRAHEDRON) / (4 * steps[:, None]))


def rotation(axis: int, degrees: float) -> Doubles:
    """Rotation matrix (3, 3) about x, y or z (0, 1, 2)."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
    return matrix
