"""Modelling of the face: soft swellings and hollows over bone and fat, and creases of the skin."""

from __future__ import annotations

import numpy as np

from dermis.human.bust.fields import Doubles, bump, cone
from dermis.human.bust.parameters import BustParameters

# Artist's values: centre x, y, z, radii along x, y, z, height outwards, all in mm, of pairs left and right;
# the last column says how much the height grows with fullness.
SWELLINGS = {
    "glabella": (0, 19, 95, 10, 8, 14, 0.8, 0),
    "medial brow": (14, 19, 91, 13, 8, 14, 1.6, 0),
    "lateral brow": (35, 19.5, 79, 18, 9, 18, 3.0, 0),
    "forehead": (24, 54, 82, 20, 18, 22, 1.5, 0),
    "temple": (60, 28, 45, 14, 22, 24, -3.5, 1.0),
    "socket": (31, 3, 80, 18, 11, 22, -5.5, 0),
    "inner socket": (16, 2, 86, 7, 9, 14, -3.0, 0),
    "under the brow": (14, 11.5, 86, 8, 7, 14, 3.4, 0),
    "hood": (34, 11, 80, 14, 5.5, 12, 1.6, 0.4),
    "tear trough": (23, -17, 84, 12, 6, 16, -1.8, 0.5),
    "malar": (46, -19, 66, 17, 13, 20, 4.5, 0),
    "zygomatic arch": (65, -14, 24, 9, 13, 30, 1.6, 0),
    "cheek": (34, -40, 82, 16, 16, 18, 3.0, 2.0),
    "cheek hollow": (52, -48, 50, 16, 20, 26, -2.4, 2.6),
    "muzzle": (0, -60, 96, 22, 14, 20, 1.0, 0),
    "mouth corner": (28, -69, 85, 5, 6, 9, -1.6, -0.4),
    "labiomental": (0, -85, 92, 17, 5, 12, -1.6, 0),
    "chin": (0, -98, 94, 14, 9, 14, 1.8, 0),
    "beside chin": (25, -97, 78, 10, 12, 16, -0.8, 0.8),
    "masseter": (53, -64, 14, 12, 22, 20, 2.2, 0.5),
}
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
    for *place, amount, growth in SWELLINGS.values():
        centre, radii = np.array(place[:3], dtype=np.float64), np.array(place[3:], dtype=np.float64)
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
