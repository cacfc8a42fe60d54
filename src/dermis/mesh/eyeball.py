"""The standard eyeball: its shape, mesh and uv, and lids that slide over it.

Lengths are in mm of an adult eye, with the origin at the centre of the ball.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index, Ints
from dermis.base.summary import ShortRepr

SCLERA_MM, CORNEA_MM, LIMBUS_MM = 12.0, 7.8, 5.85
"""Radii of the ball, of the front of the cornea, and of the circle where both meet, in adults [mm]."""
IRIS_BEHIND_MM = 3.0
"""Depth of the plane of the iris behind the cornea's apex [mm]."""
SIDE = 10
"""Quads along each edge of the cube that becomes a ball; even, so that a point is on the axis."""
UV_RIM = 0.49
"""Distance from the centre of the uv layout for the back of the eye."""
UV_FALLOFF = 0.9
"""Angle from the axis over which that distance increases more slowly [rad]."""


def limbus_plane_mm(radius_mm: float) -> float:
    """Return the distance of the plane of the limbus from the centre of a ball of this radius [mm]."""
    return math.sqrt(radius_mm**2 - LIMBUS_MM**2)


def cornea_centre_mm() -> float:
    """Return the position of the centre of the cornea's front on the axis [mm]."""
    return limbus_plane_mm(SCLERA_MM) - limbus_plane_mm(CORNEA_MM)


def apex_mm() -> float:
    """Return the position of the cornea's apex on the axis [mm]."""
    return cornea_centre_mm() + CORNEA_MM


def iris_mm() -> float:
    """Return the position of the plane of the iris on the axis [mm]."""
    return apex_mm() - IRIS_BEHIND_MM


def profile_mm(angle: Doubles) -> Doubles:
    """Return the distance of the surface from the ball's centre at an angle from the axis [rad] [mm]."""
    centre = cornea_centre_mm()
    within = np.maximum(CORNEA_MM**2 - (centre * np.sin(angle)) ** 2, 0.0)
    edge = np.arctan2(LIMBUS_MM, np.sqrt(SCLERA_MM**2 - LIMBUS_MM**2))
    return np.where(angle < edge, centre * np.cos(angle) + np.sqrt(within), SCLERA_MM)


def radial_distances_mm(points: Doubles, axis: Doubles) -> tuple[Doubles, Doubles]:
    """Return the distances of points (..., 3) from the centre, and of the surface in their directions [mm].

    axis : (..., 3) unit vectors of the eyes' axes
    """
    distance = np.linalg.norm(points, axis=-1)
    cosine = (points * axis).sum(axis=-1) / np.maximum(distance, 1e-9)
    return distance, profile_mm(np.arccos(np.clip(cosine, -1.0, 1.0)))


@dataclass(frozen=True, eq=False, repr=False)
class LidContact(ShortRepr):
    """Control points of the lids that stay outside the eyeballs, cornea included, in any pose.

    point : (n,) control points of lids
    ball : (n,) eyeball over which each of them slides
    min_clearance_mm : (n,) smallest distance from its surface, in mm of an adult eye
    apex, back : (k,) control points of each eyeball: apex of the cornea and the point opposite to it
    edge : (k, r) control points along the edges of the lids, once around each opening
    """

    point: Ints
    ball: Ints
    min_clearance_mm: Floats
    apex: Ints
    back: Ints
    edge: Ints

    def push_out(self, points_mm: Doubles) -> Doubles:
        """Return the control points (p, 3) of a posed head, with lids pushed out of the eyes [mm]."""
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
def build_eyeball(side: int = SIDE, scale: float = 1.0) -> tuple[Doubles, Index]:
    """Return the points (n, 3) of an eyeball that looks along +Z [mm], and its quads (q, 4).

    side : quads along each edge of the cube that becomes the ball
    scale : factor of the points, for control points outside the smooth surface that they produce
    """
    points, quads = list[Doubles](), list[Index]()
    grid = np.tan(np.linspace(-np.pi / 4, np.pi / 4, side + 1))  # even in angle
    u, v = (part.ravel() for part in np.meshgrid(grid, grid))
    corner = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
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
    radius = profile_mm(np.arccos(np.clip(direction[:, 2], -1.0, 1.0)))
    return scale * radius[:, None] * direction, welded.reshape(-1)[np.concatenate(quads)]


@cache
def eyeball_uv(side: int = SIDE) -> Doubles:
    """Return the uv (n, 2) of an eyeball's points: a polar map about its axis, with the back at the rim."""
    x, y, z = _directions(side).T
    angle, azimuth = np.arccos(np.clip(z, -1.0, 1.0)), np.arctan2(y, x)
    radius = UV_RIM * angle / np.pi
    return 0.5 + np.stack([radius * np.cos(azimuth), -radius * np.sin(azimuth)], axis=-1)


def axis_points(side: int = SIDE) -> tuple[int, int, int]:
    """Return the indices of the cornea's apex, the point opposite, and the point on the equator at +X."""
    directions, axes = _directions(side), ((0, 0, 1), (0, 0, -1), (1, 0, 0))
    apex, back, right = (int(np.argmax(directions @ np.array(axis))) for axis in axes)
    return apex, back, right


def _directions(side: int) -> Doubles:
    points, _ = build_eyeball(side)
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))


@dataclass(frozen=True, eq=False)
class EyeTextures:
    """Textures of an eyeball as seen along its axis, in the layout of `eye_uv`, with row 0 at v = 0.

    colour : (n, n, 3) linear [-]
    normal : (n, n, 3) unit normals of the surface below the tear film, in the axes of the layout, green up
    """

    colour: Floats
    normal: Floats


def eye_uv(points: Doubles) -> Floats:
    """Return the texture uv (n, 2) of points (n, 3) around an eyeball's centre, with z along its axis."""
    across = np.hypot(points[:, 0], points[:, 1])
    angle = np.arctan2(across, points[:, 2])
    radius = UV_RIM * np.expm1(-angle / UV_FALLOFF) / np.expm1(-np.pi / UV_FALLOFF)
    direction = points[:, :2] * [1.0, -1.0] / np.maximum(across, 1e-12)[:, None]
    return np.asarray(0.5 + radius[:, None] * direction, np.float32)
