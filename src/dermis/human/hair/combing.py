"""How hair of head and beard lies: where it points to, how far it rises and how long it is, by style."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.hair.hairy_skin import HEAD_AXIS_Z, above_hairline, smoothstep
from dermis.human.hair.look import HairLook
from dermis.human.hair.skin import flattened

# Artist's values on the average person [mm].
_WHORL = np.array([9.0, 86.0, -131.0])
_WHORL_MM = 24.0  # around it hair turns in a spiral
_PART_X = 31.0  # of the line from which short hair is swept to the other side
_PART_MM = 9.0
_TILT = 0.15  # of the levels of length, higher in front
_CROPPED_RISE, _BEARD_RISE = (0.95, 0.75), (0.85, 0.35)  # of root and tip [rad]
_SHORT_RISE, _TOP_RISE = (0.5, -0.05), (0.55, -0.35)  # at the sides, and by how much more on top


class Combed(NamedTuple):
    """How hairs lie.

    way : (n, 3) unit directions along the skin
    length_mm : (n,)
    rise, last_rise : (n,) angles over the skin of root and tip [rad]
    """

    way: Doubles
    length_mm: Doubles
    rise: Doubles
    last_rise: Doubles


def combed(places: Doubles, normals: Doubles, look: HairLook, recession: float) -> Combed:
    """The hair of the head.

    places : (n, 3) on the average person [mm]
    normals : (n, 3) of the person's skin
    recession : see `SkinLook`
    """
    grown, top, n = _grown(places, normals), _top(places), len(places)
    edge = above_hairline(places, recession)
    if look.style == "cropped":
        length = look.length_mm * (0.55 + 0.45 * smoothstep(-2.0, 22.0, edge)) * (0.85 + 0.15 * top)
        return Combed(grown, length, *(np.full(n, rise) for rise in _CROPPED_RISE))
    high = places[:, 1] + _TILT * (places[:, 2] - HEAD_AXIS_Z)
    sides = 1.0 - look.fade * (1.0 - smoothstep(-45.0, 62.0, high))
    near = 0.3 + 0.7 * np.maximum(smoothstep(0.0, 35.0, edge), top)
    length = look.length_mm * np.minimum(sides, near)
    rise = (side + more * top for side, more in zip(_SHORT_RISE, _TOP_RISE, strict=True))
    return Combed(_swept(places, normals, grown), length, *rise)


def combed_beard(places: Doubles, normals: Doubles, look: HairLook) -> Combed:
    """The beard, down and a little to the sides; see `combed`."""
    n = len(places)
    aside = 0.4 * np.clip(places[:, 0] / 25.0, -1.0, 1.0)
    way = along_skin(np.stack([aside, np.full(n, -1.0), np.zeros(n)], axis=1), normals)
    return Combed(way, np.full(n, look.beard_mm), *(np.full(n, rise) for rise in _BEARD_RISE))


def along_skin(ways: Doubles, normals: Doubles) -> Doubles:
    """Unit vectors: what of ways (n, 3) lies along the skin."""
    flat = flattened(ways, normals)
    return np.asarray(flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-9))


def turned(ways: Doubles, normals: Doubles, angle: Doubles) -> Doubles:
    """Ways along the skin turned about its normals by angles (n,) [rad]."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.asarray(c * ways + s * np.cross(normals, ways))


def _grown(places: Doubles, normals: Doubles) -> Doubles:
    """As hair grows: away from the whorl, and down at sides and nape."""
    away = places - _WHORL
    spiral = 1.1 * np.exp(-(away**2).sum(axis=1) / _WHORL_MM**2)
    ways = turned(along_skin(away, normals), normals, spiral)
    low = 1.2 * smoothstep(40.0, -30.0, places[:, 1])
    back = 0.35 * smoothstep(-120.0, -60.0, places[:, 2])
    down = np.stack([np.zeros(len(places)), -low, -low * back], axis=1)
    return along_skin(ways + down, normals)


def _top(places: Doubles) -> Doubles:
    """1 on top of the head, 0 at its sides and behind."""
    return smoothstep(48.0, 86.0, places[:, 1] + _TILT * (places[:, 2] - HEAD_AXIS_Z))


def _swept(places: Doubles, normals: Doubles, grown: Doubles) -> Doubles:
    """As hair is combed: on top from the parting to the other side, at the sides down and back."""
    one = np.ones(len(places))
    top = 2.2 * _top(places) * smoothstep(-135.0, -95.0, places[:, 2])
    away = np.tanh((places[:, 0] - _PART_X) / _PART_MM)
    across = np.stack([away, 0.25 * one, 0.55 * one], axis=1)
    side = 1.2 * (1.0 - _top(places)) * smoothstep(-120.0, -80.0, places[:, 2])
    down = np.stack([0.0 * one, -one, -0.55 * one], axis=1)
    return along_skin(grown + top[:, None] * across + side[:, None] * down, normals)
