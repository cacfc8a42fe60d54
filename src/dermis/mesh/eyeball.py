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
    """How far before the middle of a ball the cornea begins, at the limbus [mm]."""
    return math.sqrt(radius_mm**2 - LIMBUS_MM**2)


def cornea_centre_mm() -> float:
    """Where on the axis the centre of the cornea's front lies, from the ball's [mm]."""
    return limbus_plane_mm(SCLERA_MM) - limbus_plane_mm(CORNEA_MM)


def apex_mm() -> float:
    """Where on the axis the cornea's apex lies [mm]."""
    return cornea_centre_mm() + CORNEA_MM


def iris_mm() -> float:
    """Where on the axis the plane of the iris lies [mm]."""
    return apex_mm() - IRIS_BEHIND_MM


def profile_mm(angle: Doubles) -> Doubles:
    """Distance from the ball's centre to its surface, by the angle from its axis [rad] [mm]."""
    centre = cornea_centre_mm()
    within = np.maximum(CORNEA_MM**2 - (centre * np.sin(angle)) ** 2, 0.0)
    edge = np.arctan2(LIMBUS_MM, np.sqrt(SCLERA_MM**2 - LIMBUS_MM**2))
    return np.where(angle < edge, centre * np.cos(angle) + np.sqrt(within), SCLERA_MM)


def radial_distances_mm(points: Doubles, axis: Doubles) -> tuple[Doubles, Doubles]:
    """How far places (..., 3) lie from the centre and how far the surface does on the way to them [mm].

    axis : (..., 3) unit vectors along which the eye looks
    """
    distance = np.linalg.norm(points, axis=-1)
    cosine = (points * axis).sum(axis=-1) / np.maximum(distance, 1e-9)
    return distance, profile_mm(np.arccos(np.clip(cosine, -1.0, 1.0)))


@dataclass(frozen=True, eq=False, repr=False)
class LidContact(ShortRepr):
    """Control points that stay off the eyeballs of a head, cornea included, wherever these look.

    point : (n,) control points of lids
    ball : (n,) which of the eyeballs each slides over
    clear_mm : (n,) least distance from its surface, in mm of a usual eye
    apex, back : (k,) control points of each eyeball: the cornea's apex and the one opposite
    edge : (k, r) those of the lids' edges, which touch the eye, once around each opening
    """

    point: Ints
    ball: Ints
    min_clearance_mm: Floats
    apex: Ints
    back: Ints
    edge: Ints

    def push_out(self, points_mm: Doubles) -> Doubles:
        """(p, 3) all control points of a posed head, with those of the lids pushed out of the eyes [mm]."""
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
    """(n, 3) points of an eyeball around its centre, looking along +Z [mm], and (q, 4) quads.

    swell : by how much control points lie outside of the smooth surface that they make
    """
    points, quads = list[Doubles](), list[Index]()
    grid = np.tan(np.linspace(-np.pi / 4, np.pi / 4, side + 1))  # even in angle
    u, v = (part.ravel() for part in np.meshgrid(grid, grid))
    corner = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    face = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(
        -1, 4
    )
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
    """(n, 2) uv of an eyeball's points: seen along its axis, by the angle from there; the back is the rim."""
    x, y, z = _directions(side).T
    angle, azimuth = np.arccos(np.clip(z, -1.0, 1.0)), np.arctan2(y, x)
    radius = UV_RIM * angle / np.pi
    return 0.5 + np.stack([radius * np.cos(azimuth), -radius * np.sin(azimuth)], axis=-1)


def axis_points(side: int = SIDE) -> tuple[int, int, int]:
    """Points of an eyeball: the cornea's apex, the one opposite, and the one of the equator along +X."""
    directions, axes = _directions(side), ((0, 0, 1), (0, 0, -1), (1, 0, 0))
    apex, back, right = (int(np.argmax(directions @ np.array(axis))) for axis in axes)
    return apex, back, right


def _directions(side: int) -> Doubles:
    points, _ = build_eyeball(side)
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))


@dataclass(frozen=True, eq=False)
class EyeTextures:
    """An eyeball as it is seen along its axis, by the layout, row 0 at v = 0.

    colour : (n, n, 3) linear [-]
    normal : (n, n, 3) unit, of what lies below the film of tears, by the axes of the layout, green up
    """

    colour: Floats
    normal: Floats


def eye_uv(points: Doubles) -> Floats:
    """(n, 2) uv of places around an eyeball's middle (n, 3), z along its axis."""
    across = np.hypot(points[:, 0], points[:, 1])
    angle = np.arctan2(across, points[:, 2])
    radius = UV_RIM * np.expm1(-angle / UV_FALLOFF) / np.expm1(-np.pi / UV_FALLOFF)
    direction = points[:, :2] * [1.0, -1.0] / np.maximum(across, 1e-12)[:, None]
    return np.asarray(0.5 + radius[:, None] * direction, np.float32)
