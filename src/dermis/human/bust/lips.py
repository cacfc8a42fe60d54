"""The mouth: red lips, their border, the closed line between them and the philtrum, over the front plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.human.bust.fields import Doubles, rise
from dermis.human.bust.parameters import BustParameters
from dermis.tables import numbers, read_rows

BORDERS = numbers(read_rows(__package__, "lips"), "x upper line lower")
CORNER_X = 26.0


def relief(p: Doubles, parameters: BustParameters) -> Doubles:
    """How far lips and philtrum stand out of the face (n,) [mm]; p with x >= 0."""
    height = np.zeros(len(p))
    near = (p[:, 0] < 40) & (np.abs(p[:, 1] + 66) < 26) & (p[:, 2] > 60)
    height[near] = _relief(p[near, 0], p[near, 1], 1 + 0.2 * parameters.fullness)
    return height


def belongs(p: Doubles) -> NDArray[np.bool_]:
    """Which places (n, 3) on the front of the face are red lip; x >= 0."""
    upper, _, lower = _borders(p[:, 0])
    return np.asarray((p[:, 0] < CORNER_X) & (p[:, 1] < upper) & (p[:, 1] > lower))


def above(p: Doubles) -> NDArray[np.bool_]:
    """Which places (n, 3) on the front of the face lie between nose and red lip; x >= 0."""
    upper = _borders(p[:, 0])[0]
    fold_x = 19 + 0.4 * (-44 - p[:, 1])
    return np.asarray((p[:, 0] < fold_x) & (p[:, 1] >= upper) & (p[:, 1] < -44))


def _borders(x: Doubles) -> Doubles:
    """Heights of the upper border, the line and the lower border at x, (3, n) [mm]."""
    from scipy.interpolate import CubicSpline

    both = np.vstack((BORDERS[:0:-1] * (-1, 1, 1, 1), BORDERS))  # level at the midline
    curves = CubicSpline(both[:, 0], both[:, 1:])
    return np.asarray(curves(np.minimum(x, BORDERS[-1, 0])).T)


def _relief(x: Doubles, y: Doubles, full: float) -> Doubles:
    upper, line, lower = _borders(x)
    taper = 1 - np.minimum(x / CORNER_X, 1) ** 2.6
    above = np.clip((y - line) / np.maximum(upper - line, 0.8), 0, 2)
    below = np.clip((line - y) / np.maximum(line - lower, 0.8), 0, 2)
    red = 3.4 * np.where(y >= line, _bulge(above), _bulge(below)) + np.sin(np.clip(below, 0, 1) * np.pi) ** 2
    roll = 0.3 * np.exp(-(((y - upper - 0.5) / 1.7) ** 2))
    groove = np.exp(-(((y - line) / 1.25) ** 2)) * (0.4 + 1.5 * taper)
    groove *= rise(x, CORNER_X + 1, CORNER_X - 4)
    philtrum = 0.55 * np.exp(-(((x - 5.2) / 2.6) ** 2)) - 0.9 * np.exp(-((x / 3.0) ** 2))
    philtrum *= rise(y, -62, -56) * rise(y, -46, -53)
    return np.asarray(taper * (full * red + roll) - groove + philtrum)


def _bulge(t: Doubles) -> Doubles:
    """A rounded lip from the line at 0 to the border at 1, a little beyond which it has run out."""
    return np.asarray((0.55 + 0.45 * np.sin(np.clip(t / 0.45, 0, 1) * np.pi / 2)) * (1 - rise(t, 0.3, 1.25)))
