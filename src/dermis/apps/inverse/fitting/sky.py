"""Light from all around that spherical harmonics of the second order hold: lobes that add up to all of it."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.environment.panorama import directions
from dermis.mesh.geometry import fibonacci_sphere

Floats = NDArray[np.float64]
ROWS = 32
"""Of the panoramas."""
BASIS = 9
"""Spherical harmonics up to the second order: what matte shading tells of light from all around
[RamamoorthiHanrahan2001]."""
_LOBES = 48
_CANDIDATES = 400


def lobe(towards: Floats, places: Floats) -> Floats:
    """Radiance that falls off from 1 to 0 behind: the sharpest that second-order harmonics hold exactly.

    towards : (k, 3) unit vectors of the middles
    places : (..., 3) unit vectors
    """
    return np.asarray((0.5 + 0.5 * (places @ towards.T)) ** 2)


@cache
def middles() -> Floats:
    """(9, 3) middles of lobes that all others are sums of, spread as far as a greedy choice has it."""
    every = fibonacci_sphere(_CANDIDATES)
    chosen = [int(np.argmax(every[:, 2]))]
    for _ in range(BASIS - 1):  # the candidate that the lobes chosen so far describe worst
        before = lobe(every[chosen], every)
        left = lobe(every, every)
        left = left - before @ np.linalg.lstsq(before, left, rcond=None)[0]
        chosen.append(int(np.argmax((left**2).sum(axis=0))))
    return every[chosen]


@cache
def mixtures() -> tuple[Floats, Floats]:
    """(9, n) shares of the nine lobes that make up n others all around, and their middles (n, 3)."""
    towards = fibonacci_sphere(_LOBES)
    places = fibonacci_sphere(_CANDIDATES)
    shares = np.linalg.lstsq(lobe(middles(), places), lobe(towards, places), rcond=None)[0]
    return np.asarray(shares, np.float64), towards


def panorama(strengths: Floats) -> Floats:
    """(h, w) radiance of the nine lobes, which rounding leaves a little below 0 nowhere.

    strengths : (9,)
    """
    return np.maximum(lobe(middles(), directions(ROWS, 2 * ROWS)) @ strengths, 0.0)
