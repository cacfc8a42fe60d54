"""How hair of the head lies: where it points to, how far it rises and how long it is, by style."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.human.hair.hairy_skin import above_hairline, smoothstep
from dermis.human.hair.look import HairLook
from dermis.mesh.strands import Doubles

# Artist's values on the average person [mm].
_WHORL = np.array([9.0, 86.0, -131.0])
_WHORL_MM = 24.0  # around it hair turns in a spiral
_PART_X = 31.0  # of the line from which short hair is swept to the other side


class Combed(NamedTuple):
    """Of hairs (n, ...): unit directions along the skin (n, 3), lengths [mm], angles over the skin at root and tip."""

    way: Doubles
    length_mm: Doubles
    rise: Doubles
    last_rise: Doubles


def combed(places: Doubles, normals: Doubles, look: HairLook) -> Combed:
    """The hair of the head.

    places : (n, 3) on the average person [mm]
    normals : (n, 3) of the person's skin
    """
    grown = _grown(places, normals)
    if look.style == "cropped":
        n = len(places)
        length = look.length_mm * (0.82 + 0.18 * _top(places))
        return Combed(grown, length, np.full(n, 0.95), np.full(n, 0.75))
    top, edge = _top(places), above_hairline(places)
    swept = _swept(places, normals, grown)
    fade = 0.16 + 0.84 * smoothstep(-45.0, 62.0, places[:, 1] + 0.15 * (places[:, 2] + 72.0))
    whiskers = smoothstep(0.0, 40.0, edge)
    length = look.length_mm * np.minimum(fade, 0.25 + 0.75 * whiskers + 0.75 * top)
    rise = 0.5 + 0.55 * top
    return Combed(swept, length, rise, np.full(len(places), -0.05) - 0.35 * top)


def along_skin(ways: Doubles, normals: Doubles) -> Doubles:
    """Unit vectors: what of ways (n, 3) lies along the skin."""
    flat = ways - (ways * normals).sum(axis=1, keepdims=True) * normals
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
    low = smoothstep(40.0, -30.0, places[:, 1])
    down = np.array([0.0, -1.0, 0.0]) + np.array([0.0, 0.0, -0.35]) * smoothstep(-120.0, -60.0, places[:, 2])[:, None]
    return along_skin(ways + 1.2 * low[:, None] * down, normals)


def _top(places: Doubles) -> Doubles:
    """1 on top of the head, 0 at its sides and behind."""
    return np.asarray(smoothstep(48.0, 86.0, places[:, 1] + 0.16 * (places[:, 2] + 72.0)))


def _swept(places: Doubles, normals: Doubles, grown: Doubles) -> Doubles:
    """As hair is combed: from the parting to the other side and a little forward on top."""
    top = _top(places) * smoothstep(-135.0, -95.0, places[:, 2])
    across = np.stack([np.tanh((_PART_X - places[:, 0]) / 9.0) * -1.0, np.full(len(places), 0.25), np.full(len(places), 0.55)], 1)
    sides = np.stack([np.zeros(len(places)), np.full(len(places), -1.0), np.full(len(places), -0.55)], 1)
    side = (1.0 - _top(places)) * smoothstep(-120.0, -80.0, places[:, 2])
    ways = grown + 2.2 * top[:, None] * across + 1.2 * side[:, None] * sides
    return along_skin(ways, normals)
