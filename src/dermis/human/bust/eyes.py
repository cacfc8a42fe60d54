"""Closed eyes: lids over the eyeballs, their line, the groove of the lashes and the fold above."""

from __future__ import annotations

import numpy as np

from dermis.human.bust.anatomy import nominal
from dermis.human.bust.fields import Doubles, ellipsoid, rise, smooth_union
from dermis.tables import numbers, read_rows

EYE = nominal("eye")
LID_RADIUS = 13.3
LINES = numbers(read_rows(__package__, "lids"), "x line fold")


def add_lids(distance: Doubles, p: Doubles) -> Doubles:
    """The face with closed lids in its sockets; p with x >= 0."""
    near = (np.abs(p[:, 0] - 30) < 26) & (np.abs(p[:, 1]) < 26) & (p[:, 2] > 50)
    q = p[near]
    ball = ellipsoid(q, EYE, (LID_RADIUS + 0.8, LID_RADIUS, LID_RADIUS))
    joined = distance.copy()
    joined[near] = smooth_union(distance[near], ball, 9) - _relief(q[:, 0], q[:, 1])
    return joined


def _relief(x: Doubles, y: Doubles) -> Doubles:
    from scipy.interpolate import CubicSpline

    line, fold = CubicSpline(LINES[:, 0], LINES[:, 1:])(np.clip(x, 13, 50)).T
    within = rise(x, 13.5, 19) * rise(x, 48, 42)
    t = y - line
    lid = 0.7 * rise(t, -0.9, 0.7) * rise(t, 7.0, 0.9) + 0.4 * np.exp(-(((t + 2.6) / 1.5) ** 2))
    groove = 0.8 * np.exp(-(((t + 0.6) / 0.9) ** 2))
    s = y - fold
    crease = 0.4 * np.exp(-((s / 1.5) ** 2)) - 0.5 * rise(s, 0.0, 2.8) * rise(s, 9.0, 2.8)
    return np.asarray(within * (lid - groove) - crease * rise(x, 16, 26) * rise(x, 47, 37))
