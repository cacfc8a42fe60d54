"""The usual eyeball: its shape, its mesh and uv, and lids that slide over it.

Lengths are in mm of a usual eye around the centre of the ball.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index, Ints
from dermis.base.summary import ShortRepr

SCLERA_MM, CORNEA_MM, LIMBUS_MM = 12.0, 7.8, 5.85
"""Radii of the ball, of the cornea's front, and of the circle where they meet, of an adult [mm]."""
IRIS_BEHIND_MM = 3.0
"""Depth of the plane of the iris behind the cornea's apex [mm]."""
SIDE = 10
"""Quads along each edge of the cube that a ball is made from; an even number, for a point on the axis."""
RIM = 0.49
"""Distance from the middle of the layout for half a turn from the axis."""
FALLING = 0.9
"""Angle from the axis over which that distance grows less and less [rad]."""


def plane_mm(radius_mm: float) -> float:
    """How far before the middle of a ball the cornea begins, at the limbus [mm]."""
    return math.sqrt(radius_mm**2 - LIMBUS_MM**2)


def cornea_centre_mm() -> float:
    """Where on the axis the centre of the cornea's front lies, from the ball's [mm]."""
    return plane_mm(SCLERA_MM) - plane_mm(CORNEA_MM)


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


def clearance_mm(places: Doubles, axis: Doubles) -> tuple[Doubles, Doubles]:
    """How far places (..., 3) lie from the centre and how far the surface does on the way to them [mm].

    axis : (..., 3) unit vectors along which the eye looks
    """
    far = np.linalg.norm(places, axis=-1)
    along = (places * axis).sum(axis=-1) / np.maximum(far, 1e-9)
    return far, profile_mm(np.arccos(np.clip(along, -1.0, 1.0)))


@dataclass(frozen=True, eq=False, repr=False)
class Contact(ShortRepr):
    """Control points that stay off the eyeballs of a head, cornea included, wherever these look.

    point : (n,) control points of lids
    ball : (n,) which of the eyeballs each slides over
    clear_mm : (n,) least distance from its surface, in mm of a usual eye
    apex, back : (k,) control points of each eyeball: the cornea's apex and the one opposite
    edge : (k, r) those of the lids' edges, which touch the eye, once around each opening
    """

    point: Ints
    ball: Ints
    clear_mm: Floats
    apex: Ints
    back: Ints
    edge: Ints

    def kept_off(self, points_mm: Doubles) -> Doubles:
        """(p, 3) all control points of a posed head, with those of the lids pushed out of the eyes [mm]."""
        apex, back = points_mm[self.apex], points_mm[self.back]
        length = np.linalg.norm(apex - back, axis=1, keepdims=True)
        scale, axis = length / (apex_mm() + SCLERA_MM), (apex - back) / length
        middle, scale = (back + SCLERA_MM * scale * axis)[self.ball], scale[self.ball]
        off = (points_mm[self.point] - middle) / scale
        far, surface = clearance_mm(off, axis[self.ball])
        out = np.maximum(1.0, (surface + self.clear_mm) / np.maximum(far, 1e-6))
        found = points_mm.copy()
        found[self.point] = middle + scale * off * out[:, None]
        return found


@cache
def globe(side: int = SIDE, swell: float = 1.0) -> tuple[Doubles, Index]:
    """(n, 3) points of an eyeball around its centre, looking along +Z [mm], and (q, 4) quads.

    swell : by how much control points lie outside of the smooth surface that they make
    """
    places, quads = list[Doubles](), list[Index]()
    grid = np.tan(np.linspace(-np.pi / 4, np.pi / 4, side + 1))  # even in angle
    u, v = (part.ravel() for part in np.meshgrid(grid, grid))
    corner = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    face = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(
        -1, 4
    )
    ones = np.ones_like(u)
    for turn in range(3):
        for way in (1.0, -1.0):
            places.append(np.roll(np.stack([way * u, v, way * ones], axis=-1), turn, axis=1))
            quads.append(face + sum(map(len, places[:-1])))
    every = np.concatenate(places)
    _, first, welded = np.unique(np.rint(1e6 * every), axis=0, return_index=True, return_inverse=True)
    along = every[first] / np.linalg.norm(every[first], axis=1, keepdims=True)
    radius = profile_mm(np.arccos(np.clip(along[:, 2], -1.0, 1.0)))
    return swell * radius[:, None] * along, welded.reshape(-1)[np.concatenate(quads)]


@cache
def layout(side: int = SIDE) -> Doubles:
    """(n, 2) uv of an eyeball's points: seen along its axis, by the angle from there; the back is the rim."""
    along = _along(side)
    angle, turn = np.arccos(np.clip(along[:, 2], -1.0, 1.0)), np.arctan2(along[:, 1], along[:, 0])
    radius = RIM * angle / np.pi
    return 0.5 + np.stack([radius * np.cos(turn), -radius * np.sin(turn)], axis=-1)


def marks(side: int = SIDE) -> tuple[int, int, int]:
    """Points of an eyeball: the cornea's apex, the one opposite, and the one of the equator along +X."""
    along = _along(side)
    apex, back, right = (int(np.argmax(along @ np.array(way))) for way in ((0, 0, 1), (0, 0, -1), (1, 0, 0)))
    return apex, back, right


def _along(side: int) -> Doubles:
    points, _ = globe(side)
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))


@dataclass(frozen=True, eq=False)
class EyePictures:
    """An eyeball as it is seen along its axis, by the layout, row 0 at v = 0.

    colour : (n, n, 3) linear [-]
    normal : (n, n, 3) unit, of what lies below the film of tears, by the axes of the layout, green up
    """

    colour: Floats
    normal: Floats


def eye_uv(places: Doubles) -> Floats:
    """(n, 2) uv of places around an eyeball's middle (n, 3), z along its axis."""
    across = np.hypot(places[:, 0], places[:, 1])
    angle = np.arctan2(across, places[:, 2])
    radius = RIM * np.expm1(-angle / FALLING) / np.expm1(-np.pi / FALLING)
    way = places[:, :2] * [1.0, -1.0] / np.maximum(across, 1e-12)[:, None]
    return np.asarray(0.5 + radius[:, None] * way, np.float32)
