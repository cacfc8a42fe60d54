"""The standard eyeball: its shape, mesh and uv, and contact with the lids.

The eyeball is a sphere, the sclera (*ball* for short), with a spherical cap, the cornea. Lengths are for an
adult eye [mm], and the origin is the centre of the ball.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index, Ints
from dermis.base.summary import ShortRepr

SCLERA_MM, CORNEA_MM, LIMBUS_MM = 12.0, 7.8, 5.85
"""Radii in adults: of the ball, of the front of the cornea, and of the circle where they meet [mm]."""
IRIS_MM = 6.0
"""Radius of the iris [mm]."""
IRIS_DEPTH_MM = 3.0
"""Depth of the plane of the iris behind the cornea's apex [mm]."""
QUADS_PER_EDGE = 10
"""Number of quads along each edge of the cube that is projected to a ball.

The number is even, so that the axis of the eye passes through a point.
"""
UV_RADIUS_OF_BACK = 0.49
"""Distance of the back of the eye from the centre of the uv layout [-]."""
UV_RADIUS_FALLOFF_RADIANS = 0.9
"""Constant a of `eye_uv` [rad].

A surface point at the angle t from the axis has a distance from the centre of the uv layout that is
proportional to 1 - exp(-t / a).
"""


def limbus_plane_mm(radius_mm: float) -> float:
    """Return the distance from a sphere's centre to the plane of the limbus [mm].

    The limbus is the circle where sclera and cornea meet.

    radius_mm : radius of the sphere, which is the sclera or the cornea [mm]
    """
    return math.sqrt(radius_mm**2 - LIMBUS_MM**2)


def cornea_centre_mm() -> float:
    """Return the distance from the ball's centre to the centre of the corneal sphere, along the axis [mm]."""
    return limbus_plane_mm(SCLERA_MM) - limbus_plane_mm(CORNEA_MM)


def apex_mm() -> float:
    """Return the distance from the ball's centre to the apex of the cornea, along the axis [mm]."""
    return cornea_centre_mm() + CORNEA_MM


def iris_plane_mm() -> float:
    """Return the distance from the ball's centre to the plane of the iris, along the axis [mm]."""
    return apex_mm() - IRIS_DEPTH_MM


def surface_distance_mm(angle_from_axis: Doubles) -> Doubles:
    """Return the distance from the ball's centre to the outer surface of ball and cornea [mm].

    angle_from_axis : angle between the eye's axis and the ray along which the distance is measured [rad]
    """
    centre = cornea_centre_mm()
    within = np.maximum(CORNEA_MM**2 - (centre * np.sin(angle_from_axis)) ** 2, 0.0)
    edge = np.arctan2(LIMBUS_MM, np.sqrt(SCLERA_MM**2 - LIMBUS_MM**2))
    return np.where(angle_from_axis < edge, centre * np.cos(angle_from_axis) + np.sqrt(within), SCLERA_MM)


def radial_distances_mm(points: Doubles, eye_axis: Doubles) -> tuple[Doubles, Doubles]:
    """Return how far points and the eyeball's surface are from the ball's centre [mm].

    The first array has the distance of each point, the second the distance of the surface along the ray from
    the centre through that point.

    points : (..., 3) positions relative to the ball's centre [mm]
    eye_axis : (..., 3) unit vectors of the eyes' axes
    """
    distance = np.linalg.norm(points, axis=-1)
    cosine = (points * eye_axis).sum(axis=-1) / np.maximum(distance, 1e-9)
    return distance, surface_distance_mm(np.arccos(np.clip(cosine, -1.0, 1.0)))


@dataclass(frozen=True, eq=False, repr=False)
class LidContact(ShortRepr):
    """Collision response that keeps control points of the eyelids outside the eyeballs.

    point : (n,) indices of the control points of the lids
    ball : (n,) index of the eyeball over which each of these points slides
    min_clearance_mm : (n,) smallest distance of each lid point from the eyeball's surface, for an eye of
        adult size [mm]
    apex, back : (k,) indices of two control points of each eyeball: the apex of the cornea, and the opposite
        point of the ball
    edge : (k, r) indices of the control points along the lid edges of each eye, once around the opening
    """

    point: Ints
    ball: Ints
    min_clearance_mm: Floats
    apex: Ints
    back: Ints
    edge: Ints

    def push_out(self, points_mm: Doubles) -> Doubles:
        """Return the control points (p, 3) after moving points of the lids out of the eyeballs [mm].

        points_mm : (p, 3) control points of a posed head
        """
        apex, back = points_mm[self.apex], points_mm[self.back]
        length = np.linalg.norm(apex - back, axis=1, keepdims=True)
        scale, axis = length / (apex_mm() + SCLERA_MM), (apex - back) / length
        centre, scale = (back + SCLERA_MM * scale * axis)[self.ball], scale[self.ball]
        offset = (points_mm[self.point] - centre) / scale
        distance, surface = radial_distances_mm(offset, axis[self.ball])
        factor = np.maximum(1.0, (surface + self.min_clearance_mm) / np.maximum(distance, 1e-6))
        result = points_mm.copy()
        result[self.point] = centre + scale * offset * factor[:, None]
        return result


@cache
def build_eyeball(quads_per_edge: int = QUADS_PER_EDGE, position_scale: float = 1.0) -> tuple[Doubles, Index]:
    """Return the points (n, 3) [mm] and the quads (q, 4) of an eyeball that looks along +Z.

    quads_per_edge : number of quads along each edge of the cube that is projected to the ball
    position_scale : factor by which the positions are multiplied; above 1 for a control mesh, because its
        subdivision surface is smaller
    """
    points, quads = list[Doubles](), list[Index]()
    grid = np.tan(np.linspace(-np.pi / 4, np.pi / 4, quads_per_edge + 1))  # evenly spaced in angle
    u, v = (part.ravel() for part in np.meshgrid(grid, grid))
    corner = np.arange((quads_per_edge + 1) ** 2).reshape(quads_per_edge + 1, quads_per_edge + 1)
    around = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    face = np.stack(around, axis=-1).reshape(-1, 4)
    ones = np.ones_like(u)
    for axis in range(3):
        for sign in (1.0, -1.0):
            points.append(np.roll(np.stack([sign * u, v, sign * ones], axis=-1), axis, axis=1))
            quads.append(face + sum(map(len, points[:-1])))
    cube = np.concatenate(points)
    _, first, welded = np.unique(np.rint(1e6 * cube), axis=0, return_index=True, return_inverse=True)
    direction = cube[first] / np.linalg.norm(cube[first], axis=1, keepdims=True)
    radius = surface_distance_mm(np.arccos(np.clip(direction[:, 2], -1.0, 1.0)))
    return position_scale * radius[:, None] * direction, welded.reshape(-1)[np.concatenate(quads)]


@cache
def eyeball_uv(quads_per_edge: int = QUADS_PER_EDGE) -> Doubles:
    """Return the uv (n, 2) of an eyeball's points: polar coordinates about its axis.

    The apex of the cornea is in the middle, the back of the ball at the rim.

    quads_per_edge : number of quads along a cube edge, see `build_eyeball`
    """
    x, y, z = _point_directions(quads_per_edge).T
    angle, azimuth = np.arccos(np.clip(z, -1.0, 1.0)), np.arctan2(y, x)
    radius = UV_RADIUS_OF_BACK * angle / np.pi
    return 0.5 + np.stack([radius * np.cos(azimuth), -radius * np.sin(azimuth)], axis=-1)


def axis_points(quads_per_edge: int = QUADS_PER_EDGE) -> tuple[int, int, int]:
    """Return three point indices: the apex of the cornea, the back of the ball, and the ball's equator at +X.

    quads_per_edge : number of quads along a cube edge, see `build_eyeball`
    """
    directions, axes = _point_directions(quads_per_edge), ((0, 0, 1), (0, 0, -1), (1, 0, 0))
    apex, back, right = (int(np.argmax(directions @ np.array(axis))) for axis in axes)
    return apex, back, right


def _point_directions(quads_per_edge: int) -> Doubles:
    points, _ = build_eyeball(quads_per_edge)
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))


@dataclass(frozen=True, eq=False)
class EyeTextures:
    """Textures of an eyeball as seen along its axis, in the uv layout of `eye_uv`, with row 0 at v = 0.

    colour : (n, n, 3) linear colour [-]
    normal : (n, n, 3) unit normals of the surface below the tear film, x along u, y against v (green up)
    """

    colour: Floats
    normal: Floats


def eye_uv(points: Doubles) -> Floats:
    """Return the uv (n, 2) of surface points in the layout of `EyeTextures`.

    points : (n, 3) positions relative to the eyeball's centre, with z along its axis
    """
    across = np.hypot(points[:, 0], points[:, 1])
    angle = np.arctan2(across, points[:, 2])
    radius = (
        UV_RADIUS_OF_BACK
        * np.expm1(-angle / UV_RADIUS_FALLOFF_RADIANS)
        / np.expm1(-np.pi / UV_RADIUS_FALLOFF_RADIANS)
    )
    direction = points[:, :2] * [1.0, -1.0] / np.maximum(across, 1e-12)[:, None]
    return np.asarray(0.5 + radius[:, None] * direction, np.float32)
