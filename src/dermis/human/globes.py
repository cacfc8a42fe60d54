"""The human's eyeballs: quads of true shape where the published balls are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.human.lids import FORWARD_MM, SPLINE, Socket
from dermis.mesh.eyeball import globe as true_globe

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]


def globe() -> tuple[Doubles, Index]:
    """(n, 3) control points of an eyeball around its centre, looking along +Z [mm], and (q, 4) quads."""
    return true_globe(swell=SPLINE)


def placed(eye: Socket) -> tuple[Doubles, Doubles]:
    """(n, 3) points of a person's eyeball, and its centre (3,) [mm]."""
    centre = eye.middle + eye.size * FORWARD_MM * np.array([0.0, 0.0, 1.0])
    return centre + eye.size * globe()[0], centre
