"""Position and uv layout of the human's teeth: u along the dental arch, v upwards from the biting edge."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.human.lips import lip_wall
from dermis.human.makehuman import Points, group_points
from dermis.human.skin.surface import average_surface

Doubles = NDArray[np.float64]

MM_PER_U, MM_PER_V = 160.0, 40.0
"""Lengths of a unit of u and of v [mm]."""
ARCH_MIDDLE_U, BITING_EDGE_V = 0.5, 0.02
"""u of the gap between the two middle teeth, and v of the biting edge."""
_ARCH_SAMPLE_COUNT = 2000
_UPPER, _LOWER, _TONGUE = "helper-upper-teeth", "helper-lower-teeth", "helper-tongue"
_VISIBLE_MM, _OVERBITE_MM = 2.5, 2.0
"""Length of the upper incisors below the line between closed lips, and overlap with the lower ones [mm]."""
_LIP_CLEARANCE_MM = 1.0
"""Distance between the upper incisors and the inner surface of the lips [mm]."""
_INCISOR_HALF_WIDTH_MM = 8.0
"""Distance from the middle within which points of the teeth belong to the middle incisors [mm]."""
_INCISOR_DEPTH_MM = 4.0
"""Distance behind the foremost point of the teeth within which points belong to the incisors [mm]."""


def place_teeth(points_mm: Points) -> Points:
    """Return the points (n, 3) of a person in rest pose with teeth and tongue placed relative to the lips.

    MakeHuman's teeth end above the line between the lips and are 4 mm behind them, so that open mouths would
    show hardly any teeth.

    points_mm : points with closed lips [mm]
    """
    placed, wall = points_mm.copy(), lip_wall(points_mm)
    upper, lower = (_incisor_points(points_mm, name) for name in (_UPPER, _LOWER))
    edge_y = wall.contact_y - _VISIBLE_MM
    forward = min(wall.upper_z, wall.lower_z) - _LIP_CLEARANCE_MM - upper[:, 2].max()
    lower_rise = edge_y + _OVERBITE_MM - lower[:, 1].max()
    for name, rise in ((_UPPER, edge_y - upper[:, 1].min()), (_LOWER, lower_rise), (_TONGUE, lower_rise)):
        placed[group_points(name)] += [0.0, rise, forward]
    return placed


@cache
def biting_edge_point() -> int:
    """Return the index of a point on the biting edge of the upper middle incisors."""
    points = group_points(_UPPER)
    x, y, z = average_surface()[0][points].astype(np.float64).T
    is_incisor = (np.abs(x) < _INCISOR_HALF_WIDTH_MM) & (z > z.max() - _INCISOR_DEPTH_MM)
    return int(points[np.where(is_incisor, y, np.inf).argmin()])


def _incisor_points(points_mm: Points, group_name: str) -> Points:
    """Return the points (n, 3) of the middle incisors of a group of teeth."""
    points = points_mm[group_points(group_name)]
    return points[np.abs(points[:, 0]) < _INCISOR_HALF_WIDTH_MM]


@cache
def teeth_layout(upper: bool) -> tuple[NDArray[np.int64], Doubles]:
    """Return the point indices (n,) of the upper or lower teeth, and their uv (n, 2).

    The uv coordinates are computed on the average person and are the same for all people.
    """
    points = group_points("helper-upper-teeth" if upper else "helper-lower-teeth")
    x, y, z = average_surface()[0][points].astype(np.float64).T
    across, deep = float(np.abs(x).max()), float(np.ptp(z))
    angle = np.arctan2(x / across, (z - z.min()) / deep)
    v = BITING_EDGE_V + (y - y.min() if upper else y.max() - y) / MM_PER_V
    return points, np.stack([ARCH_MIDDLE_U + _arc_length(angle, across, deep) / MM_PER_U, v], axis=-1)


def _arc_length(ellipse_angle: Doubles, half_width_mm: float, half_depth_mm: float) -> Doubles:
    """Return the signed arc length (n,) along the elliptic dental arch from the middle of the teeth [mm].

    ellipse_angle : (n,) parameter of the ellipse [rad]
    half_width_mm, half_depth_mm : half axes of the ellipse, sideways and backwards [mm]
    """
    t = np.linspace(0.0, np.pi / 2, _ARCH_SAMPLE_COUNT)
    step = np.hypot(half_width_mm * np.cos(t), half_depth_mm * np.sin(t)) * (t[1] - t[0])
    return np.asarray(np.sign(ellipse_angle) * np.interp(np.abs(ellipse_angle), t, np.cumsum(step) - step[0]))
