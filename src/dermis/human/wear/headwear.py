"""Headwear: cap, beanie, turban and headscarf as shells over a person's skull, made by eye."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.curves import smoothstep
from dermis.human.wear.crown import AZIMUTH, COLUMNS, Crown, Height, Rim, Row, fit_crown
from dermis.human.wear.folds import smooth_noise
from dermis.human.wear.panels import Grid, PanelVertices
from dermis.human.wear.skin_sheet import unit_vectors
from dermis.human.wear.skull import unit_direction
from dermis.human.wear.tubes import Solid, tube

_LINING_MM = 1.0  # height of the inside of headwear above the skin
_LINING_WAYS = 0.3, 0.2, 0.1
_FLARE = 1.2  # slope of the outside of hair below the rim
_FLARE_REACH_MM = 30.0  # distance from the rim up to which hair below it is limited
_BRIM_HALF_ANGLE = np.radians(62.0)
_BRIM_LENGTH_MM, _BRIM_THICKNESS_MM, _BRIM_DROP, _BRIM_ARCH = 66.0, 2.2, 0.2, 0.0034
_CAP_SEAMS, _SEAM_WIDTH_DEGREES, _SEAM_DEPTH_MM = 6, 2.2, 0.7


class Style(NamedTuple):
    """Kind of headwear.

    rim : lower border of the crown
    outer_mm : height of the outside above the stretched surface of the skull
    make : function that makes the solids of a person from the crown
    """

    rim: Rim
    outer_mm: Height
    make: Callable[[Crown], list[Solid]]


def headwear_solids(style: str, control_mm: Doubles) -> list[Solid]:
    """Return the parts of headwear that fit a person; triangles depend only on the style.

    control_mm : (p, 3) control points of the person at rest
    """
    own = STYLES[style]
    return own.make(fit_crown(control_mm, own.rim))


class HeadwearRoom(NamedTuple):
    """Room between the skin and the outside of headwear, in which hair has to stay."""

    crown: Crown
    outer_mm: Height

    def limits_mm(self, points_mm: Doubles) -> tuple[Doubles, Doubles, Doubles]:
        """Return height above the skin, height of the outside, and distance inside the rim of points [mm].

        The heights are along the radius. That of the outside rises below the rim, and is infinite farther
        down.

        points_mm : (n, 3) points [mm]
        """
        offset = points_mm - self.crown.skull.centre_mm
        radius = np.linalg.norm(offset, axis=-1)
        azimuth = np.arctan2(offset[..., 0], offset[..., 2])
        elevation = np.arcsin(np.clip(offset[..., 1] / np.maximum(radius, 1e-6), -1.0, 1.0))
        way = self.crown.way(azimuth, elevation)
        inside = (elevation - self.crown.elevation(azimuth, np.zeros_like(way))) * radius
        on_crown = np.clip(way, 0.0, 1.0)
        outside = self.crown.base_radius_mm(azimuth, on_crown) + self.outer_mm(azimuth, on_crown)
        skin = self.crown.skull.radius_in(unit_direction(azimuth, elevation))
        room = outside - skin + _FLARE * np.maximum(-inside, 0.0)
        return radius - skin, np.where(inside > -_FLARE_REACH_MM, room, np.inf), inside

    def outward(self, points_mm: Doubles) -> Doubles:
        """Return unit vectors (n, 3) from the centre of the skull to points (n, 3) [mm]."""
        return unit_vectors(points_mm - self.crown.skull.centre_mm)


def headwear_room(style: str, control_mm: Doubles) -> HeadwearRoom:
    """Return the room for hair below the headwear of a person.

    control_mm : (p, 3) control points of the person at rest
    """
    own = STYLES[style]
    return HeadwearRoom(fit_crown(control_mm, own.rim), own.outer_mm)


def _outside(crown: Crown, height: Height, ways: Doubles, slot: str = "cloth") -> Solid:
    """Return the outside of a crown from its rim to the apex, with a lining inside the rim."""
    lining = [Row(np.full(COLUMNS, way), np.full(COLUMNS, _LINING_MM)) for way in _LINING_WAYS]
    edge = height(AZIMUTH, np.zeros(COLUMNS))
    fold = [Row(np.full(COLUMNS, way), _LINING_MM + share * (edge - _LINING_MM)) for way, share in _EDGE]
    outer = [Row(np.full(COLUMNS, way), height(AZIMUTH, np.full(COLUMNS, way))) for way in ways]
    return crown.shell([*lining, *fold, *outer], slot)


_EDGE = (0.02, 0.0), (0.004, 0.15), (-0.004, 0.5), (0.004, 0.85)
"""Rows around the rim: the way from rim to apex, and the height as a fraction of that of the outside."""


def _beanie_height(azimuth: Doubles, way: Doubles) -> Doubles:
    knit = 0.5 * smooth_noise(8.0 * unit_direction(azimuth, 1.5 * way), 21) * smoothstep(0.4, 0.6, way)
    gathers = 1.6 * np.cos(10.0 * azimuth) * smoothstep(0.62, 0.8, way) * smoothstep(1.0, 0.9, way)
    slack = 15.0 * smoothstep(0.3, 1.0, way)
    cuff = 3.2 * smoothstep(_CUFF_END + 0.012, _CUFF_END, way)
    return np.asarray(4.2 + cuff + slack + knit + gathers)


_CUFF_END = 0.36
"""End of the cuff of a beanie on the way from rim to apex."""


def _beanie(crown: Crown) -> list[Solid]:
    cuff = _outside(crown, _beanie_height, np.concatenate([np.linspace(0.02, _CUFF_END, 14)]), "trim")
    top = np.concatenate([[_CUFF_END - 0.01, _CUFF_END + 0.014], np.linspace(_CUFF_END + 0.03, 1.0, 34)])
    rows = [Row(np.full(COLUMNS, way), _beanie_height(AZIMUTH, np.full(COLUMNS, way))) for way in top]
    rows[0] = Row(rows[0].way, _beanie_height(AZIMUTH, rows[0].way))
    return [cuff, crown.shell(rows, "cloth")]


def _cap_height(azimuth: Doubles, way: Doubles) -> Doubles:
    front = 0.5 + 0.5 * np.cos(azimuth)
    standing = (5.0 + 9.0 * front) * smoothstep(0.0, 0.45, way) + 3.0 * smoothstep(0.4, 1.0, way)
    apart = (
        np.degrees(np.abs((azimuth * _CAP_SEAMS / (2.0 * np.pi) + 0.5) % 1.0 - 0.5))
        * 2.0
        * np.pi
        / _CAP_SEAMS
    )
    seam = _SEAM_DEPTH_MM * np.exp(-((apart / _SEAM_WIDTH_DEGREES) ** 2)) * smoothstep(0.02, 0.08, way)
    return np.asarray(3.0 + standing - seam)


def _cap(crown: Crown) -> list[Solid]:
    shell = _outside(crown, _cap_height, np.linspace(0.02, 1.0, 34))
    return [shell, _brim(crown), _knob(crown, _cap_height, 5.0, "button")]


def _brim(crown: Crown) -> Solid:
    """Return the brim of a cap: an arched plate with a rounded edge."""
    azimuth = np.linspace(-1.0, 1.0, 65) * _BRIM_HALF_ANGLE
    start = crown.points(azimuth, np.full(65, 0.015), np.full(65, 1.6))
    length = _BRIM_LENGTH_MM * (1.0 - (np.abs(azimuth) / _BRIM_HALF_ANGLE) ** 2.4)
    out = np.concatenate([np.linspace(0.0, 1.0, 14), np.linspace(1.0, 0.0, 14)])[:, None]
    side = np.repeat([-0.5, 0.5], 14)[:, None] * np.ones(65)
    side[13:15] *= 0.4
    x = np.broadcast_to(start[:, 0] * (1.0 + 0.12 * out), (28, 65))
    z = start[:, 2] + out * length
    arch = _BRIM_ARCH * start[:, 0] ** 2 * (length / _BRIM_LENGTH_MM) ** 0.5 * smoothstep(0.0, 1.0, out)
    y = start[:, 1] - out * length * _BRIM_DROP - arch + side * _BRIM_THICKNESS_MM
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    grid = Grid(28, 65, False)
    triangles = np.concatenate([grid.triangles, grid.end_caps])
    vertices = PanelVertices(np.arange(len(points), dtype=np.int32), points[:, [0, 2]], triangles)
    return Solid(points, triangles, "cloth", vertices)


def _knob(crown: Crown, height: Height, radius_mm: float, slot: str) -> Solid:
    """Return a flat knob on the apex of a crown."""
    top = crown.points(np.zeros(1), np.ones(1), height(np.zeros(1), np.ones(1)))[0]
    t = np.linspace(-1.0, 1.0, 9)
    path = top + np.stack([0 * t, 0.45 * radius_mm * t, 0 * t], axis=1)
    size = radius_mm * np.sqrt(np.maximum(1.0 - 0.98 * t**2, 0.0))
    return tube(path, np.tile([1.0, 0.0, 0.0], (9, 1)), size, size, slot)


def _turban_height(azimuth: Doubles, way: Doubles) -> Doubles:
    """Return the height of bands of cloth that cross at the front, one above the other."""
    side = np.sin(0.5 * azimuth) ** 2  # 0 at the front, 1 at the back
    signed = np.where(np.sin(azimuth) >= 0.0, 1.0, -1.0)
    lift = np.abs(np.sin(azimuth))
    band = 5.2 * way + 1.25 * lift - 0.5 * side + 0.5 * (signed > 0) * smoothstep(0.0, 0.25, lift)
    part = band - np.floor(band)
    roll = np.sqrt(np.maximum(part * (1.0 - part), 0.0)) * 2.0
    bulk = 7.0 + (11.0 + 2.0 * lift) * smoothstep(0.0, 0.35, way) - 4.0 * smoothstep(0.55, 1.0, way)
    wrinkle = 1.2 * smooth_noise(unit_direction(azimuth, 3.0 * way) * [5.0, 9.0, 5.0], 22)
    fade = smoothstep(1.0, 0.92, way)
    return np.asarray(bulk + (4.5 * roll + wrinkle) * fade)


def _turban(crown: Crown) -> list[Solid]:
    return [_outside(crown, _turban_height, np.linspace(0.02, 1.0, 64))]


def _scarf_height(azimuth: Doubles, way: Doubles) -> Doubles:
    back = np.sin(0.5 * azimuth) ** 2
    pull = np.sin(9.0 * azimuth + 6.0 * way) * back**3 * smoothstep(0.75, 0.2, way)
    soft = smooth_noise(unit_direction(azimuth, 1.5 * way) * [3.0, 5.0, 3.0], 23)
    return np.asarray(
        3.4 + 2.5 * smoothstep(0.0, 0.4, way) + 1.3 * pull + 1.2 * soft * smoothstep(0.0, 0.15, way)
    )


def _headscarf(crown: Crown) -> list[Solid]:
    shell = _outside(crown, _scarf_height, np.linspace(0.02, 1.0, 44))
    knot = crown.points(np.full(1, np.pi), np.full(1, 0.02), np.full(1, 9.0))[0]
    t = np.linspace(-1.0, 1.0, 13)
    bulb = knot + np.stack([11.0 * t, 0 * t, 2.0 * np.cos(2.0 * t)], axis=1)
    size = np.sqrt(np.maximum(1.0 - 0.96 * t**2, 0.0))
    parts = [shell, tube(bulb, np.tile([0.0, 0.0, 1.0], (13, 1)), 6.5 * size, 8.5 * size, "cloth")]
    for side in (1.0, -1.0):
        s = np.linspace(0.0, 1.0, 24)
        away = side * (4.0 + 13.0 * s + 3.0 * np.sin(5.0 * s))
        path = knot + np.stack([away, -4.0 - 96.0 * s, -2.0 - 10.0 * np.sin(np.pi * s)], axis=1)
        width = 5.0 + 11.0 * smoothstep(0.0, 0.5, s)
        facing = np.stack([np.ones(24), 0 * s, 0.5 * side * np.sin(6.0 * s)], axis=1)
        parts.append(tube(path, facing, width, np.full(24, 1.4), "cloth"))
    return parts


STYLES: Mapping[str, Style] = {
    "cap": Style(
        ((0.0, 50.0, 90.0, 110.0, 135.0, 180.0), (15.0, 8.0, -2.0, -4.0, -11.0, -17.0)), _cap_height, _cap
    ),
    "beanie": Style(
        ((0.0, 50.0, 90.0, 112.0, 135.0, 180.0), (9.0, 3.0, -7.0, -9.0, -24.0, -34.0)),
        _beanie_height,
        _beanie,
    ),
    "turban": Style(
        ((0.0, 50.0, 90.0, 115.0, 140.0, 180.0), (19.0, 7.0, -5.0, -8.0, -18.0, -24.0)),
        _turban_height,
        _turban,
    ),
    "headscarf": Style(
        ((0.0, 50.0, 90.0, 115.0, 140.0, 180.0), (21.0, 9.0, -5.0, -8.0, -24.0, -34.0)),
        _scarf_height,
        _headscarf,
    ),
}
"""Kinds of headwear by name."""
