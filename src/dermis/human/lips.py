"""Lips that touch in the rest pose, with a closed line between them instead of a slit."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.tables import float_columns, read_rows
from dermis.human.makehuman import Points
from dermis.human.skin.surface import average_surface

Index = NDArray[np.int64]

_RINGS = "vermilion lip crest rim contact inner wall"
_RIM, _CONTACT, _INNER, _WALL = 3, 4, 5, 6  # columns of lip_rings.csv
_RING_MOTION = np.array([0.0, 0.15, 0.4, 0.75, 1.0, 1.0, 0.4])
"""Displacement of each ring relative to that of the ring on which the lips touch [-]."""
_NEIGHBOUR_WEIGHT = 1 / 6
"""Weight of each of the two neighbours of a point when a row of points is smoothed [-]."""
_OVERLAP_MM, _OVERLAP_TAPER_MM = 0.3, 3.0
"""Overlap of the smooth lips, and the distance from the corners within which it decreases to 0 [mm]."""
_VIEW_SLOPE = 0.22
"""Largest slope of views from above or below in which closed lips hide the inside of the mouth [-]."""


class _LipPairs(NamedTuple):
    """Points of half of the lips, and the opposite point of each.

    rings : (2, r, 7) indices of the points of the left and the right half
    opposite : (r, r) weights of the points of the contact ring; row k gives the point opposite to point k
    upper : (r,) 1 for points of the upper lip, -1 for points of the lower lip, 0 for the corner
    overlap_mm : (r,) overlap of closed lips [mm]
    """

    rings: Index
    opposite: Points
    upper: Points
    overlap_mm: Points


def close_lips(points_mm: Points) -> Points:
    """Return the points (n, 3) of a person in the rest pose with lips that touch [mm].

    Upper and lower lip move towards each other by half of the gap between their smooth surfaces. The rings
    around the gap follow, less with increasing distance from it. Lips that already touch are unchanged.
    """
    pairs, closed = _lip_pairs(), points_mm.copy()
    for rings in pairs.rings:
        heights = points_mm[rings, 1]
        beside = heights[:, _RIM] + heights[:, _INNER]
        smooth = (1.0 - 2.0 * _NEIGHBOUR_WEIGHT) * heights[:, _CONTACT] + _NEIGHBOUR_WEIGHT * beside
        depth = points_mm[rings[:, _CONTACT], 2]
        overlap = pairs.overlap_mm + _VIEW_SLOPE * np.abs(depth - pairs.opposite @ depth)
        gap = np.maximum(pairs.upper * (smooth - pairs.opposite @ smooth) + overlap, 0.0)
        closed[rings, 1] -= np.outer(0.5 * gap * pairs.upper / _smooth_motion(), _RING_MOTION)
    return closed


def mouth_edge() -> NDArray[np.int32]:
    """Return the points (r,) on which the lips touch, counter-clockwise around the mouth as seen from inside.

    They start in the middle of the upper lip and pass the left corner first.
    """
    left, right = _lip_pairs().rings[:, :, _CONTACT]
    return np.concatenate([left, right[-2:0:-1]]).astype(np.int32)


class LipWall(NamedTuple):
    """Position of the inner surface of closed lips in the middle of the mouth.

    contact_y : height of the line on which the lips touch [mm]
    upper_z, lower_z : z of the inner surface of the upper and the lower lip [mm]
    """

    contact_y: float
    upper_z: float
    lower_z: float


def lip_wall(points_mm: Points) -> LipWall:
    """Return the position of the inner surface of the closed lips of a person.

    points_mm : points (n, 3) of the person with closed lips [mm]
    """
    left = _lip_pairs().rings[0]
    upper, lower = points_mm[left[0]], points_mm[left[-1]]
    return LipWall(float(upper[_CONTACT, 1]), float(upper[_WALL, 2]), float(lower[_WALL, 2]))


def _smooth_motion() -> float:
    """Return the displacement of the smooth surface relative to that of the contact ring [-]."""
    beside = float(_RING_MOTION[_RIM] + _RING_MOTION[_INNER])
    return 1.0 - 2.0 * _NEIGHBOUR_WEIGHT + _NEIGHBOUR_WEIGHT * beside


@cache
def _lip_pairs() -> _LipPairs:
    left = float_columns(read_rows("dermis.human", "lip_rings"), _RINGS).astype(np.int64)
    average_mm = average_surface()[0].astype(np.float64)
    mirrored = average_mm[left.ravel()] * np.array([-1.0, 1.0, 1.0])
    right = np.array([np.abs(average_mm - point).sum(axis=1).argmin() for point in mirrored])
    x = average_mm[left[:, _CONTACT], 0]
    corner, rows = int(x.argmax()), np.arange(len(x))
    halves = rows[: corner + 1], rows[corner:][::-1]  # from the middle to the corner
    opposite = np.eye(len(x))
    for one, other in (halves, halves[::-1]):
        for row in one[:-1]:
            opposite[row] = [np.interp(x[row], x[other], unit[other]) for unit in np.eye(len(x))]
    upper = np.sign(corner - rows).astype(np.float64)
    overlap_mm = _OVERLAP_MM * np.clip((x[corner] - x) / _OVERLAP_TAPER_MM, 0.0, 1.0)
    return _LipPairs(np.stack([left, right.reshape(left.shape)]), opposite, upper, overlap_mm)
