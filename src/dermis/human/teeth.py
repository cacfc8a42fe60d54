"""Uv layout of the human's teeth: u along the dental arch, v upwards from the biting edge."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.human.makehuman import group_points
from dermis.human.skin.surface import average_surface

Doubles = NDArray[np.float64]

MM_PER_U, MM_PER_V = 160.0, 40.0
"""Lengths of a unit of u and of v [mm]."""
ARCH_MIDDLE_U, BITING_EDGE_V = 0.5, 0.02
"""u of the gap between the two middle teeth, and v of the biting edge."""
_ARCH_SAMPLE_COUNT = 2000


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
