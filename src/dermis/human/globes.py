"""The human's eyeballs: quads of true shape where the published balls are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.globe import globe as true_globe

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]

_BALL_MM = 15.4
"""Mean radius of the published ball, which lids lie on, where the eye is of usual size [mm]."""
_SPLINE = 1.0045
"""By how much the smooth surface lies within its control points."""


def globe() -> tuple[Doubles, Index]:
    """(n, 3) control points of an eyeball around its centre, looking along +Z [mm], and (q, 4) quads."""
    return true_globe(swell=_SPLINE)


def placed(balls: Doubles) -> tuple[Doubles, Doubles]:
    """(n, 3) points of a person's eyeball, and its centre (3,) [mm].

    balls : (b, 3) of the published ball there
    """
    middle = (balls.min(axis=0) + balls.max(axis=0)) / 2
    size = float(np.linalg.norm(balls - middle, axis=1).mean()) / _BALL_MM
    return middle + size * globe()[0], middle
