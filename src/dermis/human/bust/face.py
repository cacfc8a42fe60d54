"""Modelling of the face: soft swellings and hollows over bone and fat, and creases of the skin."""

from __future__ import annotations

import numpy as np

from dermis.human.bust.fields import Doubles, bump, cone
from dermis.human.bust.parameters import BustParameters
from dermis.tables import numbers, read_rows

SWELLINGS = numbers(read_rows(__package__, "swellings"), "x y z rx ry rz height growth")
# Start x, y, z, end x, y, z, radius, depth, and how much the depth lessens with fullness.
CREASES = {"nasolabial": (18, -41, 92, 33, -68, 82, 4.5, 1.3, 0.5)}


def modelling(p: Doubles, parameters: BustParameters) -> Doubles:
    """How far the skin stands out over the large masses (n,) [mm]."""
    height = np.zeros(len(p))
    near = (p[:, 1] > -135) & (p[:, 2] > -45)
    height[near] = _swell(p[near], parameters.fullness) - _crease(p[near], parameters.fullness)
    return height


def _swell(p: Doubles, fullness: float) -> Doubles:
    height = np.zeros(len(p))
    for row in SWELLINGS:
        centre, radii, (amount, growth) = row[:3], row[3:6], row[6:]
        spot = bump(p, centre, radii)
        if 0 < centre[0] < 3 * radii[0]:  # the twin reaches over the midline
            spot += bump(p, centre * (-1, 1, 1), radii)
        height += (amount + growth * fullness) * spot
    return height


def _crease(p: Doubles, fullness: float) -> Doubles:
    depth = np.zeros(len(p))
    for *place, radius, amount, loss in CREASES.values():
        away = cone(p, place[:3], place[3:], 0, 0)
        depth += (amount - loss * fullness) * np.exp(-((away / radius) ** 2))
    return depth
