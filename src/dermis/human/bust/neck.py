"""Neck, shoulders and chest, cut as a classical bust."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.human.bust.fields import Doubles, ellipsoid, smooth_intersection, smooth_union, tube

BOTTOM_Y = -255.0
# Artist's values of the neck's column: height y, depth of its middle, radius [mm].
COLUMN = np.array(
    [[-230, -56, 56], [-190, -47, 51], [-160, -39, 49], [-115, -27, 48], [-80, -27, 47], [-40, -31, 44]]
)
# Artist's values of three bent rods: x, y, z, radius [mm].
MUSCLE = [(45, -32, -32, 6), (43, -80, -17, 8), (33, -120, -2, 8.5), (20, -160, 3, 8), (9, -195, 4, 6)]
TRAPEZIUS = [(8, -60, -54, 24), (26, -125, -60, 31), (78, -165, -56, 33), (165, -206, -42, 36)]
COLLARBONE = [(14, -196, 9, 6), (70, -194, 9, 6), (140, -190, -20, 7)]


def add_neck(distance: Doubles, p: Doubles) -> Doubles:
    """The head set on neck and shoulders; p with x >= 0."""
    low = p[:, 1] < 0
    q, joined = p[low], distance.copy()
    whole = smooth_union(distance[low], _column(q), 22)
    # the sternomastoid, from behind the ear to the notch over the breastbone
    whole = smooth_union(whole, tube(q, MUSCLE, 6), 16)
    joined[low] = smooth_union(whole, _torso(q), 30)
    return joined


def _column(p: Doubles) -> Doubles:
    """Neck without muscles, a leaning round pillar."""
    from scipy.interpolate import CubicSpline

    middle, radius = CubicSpline(COLUMN[:, 0], COLUMN[:, 1:])(np.clip(p[:, 1], -230, -40)).T
    return np.asarray(np.hypot(p[:, 0], p[:, 2] - middle) - radius)


def _torso(p: Doubles) -> Doubles:
    chest = ellipsoid(p, (0, -288, -36), (178, 122, 84))
    blade = ellipsoid(p, (66, -215, -66), (84, 62, 46))
    shoulder = ellipsoid(p, (160, -244, -36), (52, 62, 52))
    whole = smooth_union(smooth_union(tube(p, TRAPEZIUS, 6), chest, 40), blade, 40)
    return smooth_union(smooth_union(whole, shoulder, 40), tube(p, COLLARBONE, 3), 20)


def cut(distance: Doubles, p: Doubles) -> Doubles:
    """The bust cut off below the collar, rounded at the sides and flat at the bottom."""
    trimmed = smooth_intersection(distance, _rounded(p), 12)
    return smooth_intersection(trimmed, BOTTOM_Y - p[:, 1], 12)


def belongs_to_cut(p: Doubles) -> NDArray[np.bool_]:
    """Which places (n, 3) on the surface were inside the body before the cut."""
    return np.asarray(np.maximum(_rounded(p), BOTTOM_Y - p[:, 1]) > -2.7)


def _rounded(p: Doubles) -> Doubles:
    """Distance to what the cut keeps at the sides."""
    rounded = ellipsoid(p, (0, -140, -30), (182, 128, 190))
    return np.where(p[:, 1] < -140, rounded, np.abs(p[:, 0]) - 182)
