"""Basis of ambient light, lobes of second-order spherical harmonics, and least squares for its strengths."""

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


_RIDGE = 1e-9


def strengths_of(A: Floats, b: Floats) -> Floats:
    """(9 + k,) strengths of nine lobes and k suns under which all light is from 0 on.

    A : (m, 9 + k) weighed pixels in each light alone
    b : (m,) the weighed photograph
    """
    return strengths_by(A.T @ A, A.T @ b)


def strengths_by(gram: Floats, right: Floats) -> Floats:
    """The same by A' A (9 + k, 9 + k) and A' b (9 + k,)."""
    from scipy.optimize import nnls

    R = np.linalg.cholesky(gram + _RIDGE * np.trace(gram) * np.eye(len(gram)))
    mixed = mixing(len(gram) - BASIS)
    found = nnls(R.T @ mixed, np.linalg.solve(R, right))[0]
    return np.asarray(mixed @ found)


def mixing(suns: int) -> Floats:
    """(9 + k, n + k) of the lobes and suns, by the n lobes of which all light from around is a sum."""
    shares, _ = mixtures()
    made = np.zeros((BASIS + suns, shares.shape[1] + suns))
    made[:BASIS, : shares.shape[1]] = shares
    made[BASIS:, shares.shape[1] :] = np.eye(suns)
    return made


def fault_by(gram: Floats, right: Floats, total: float, x: Floats) -> float:
    """Sum of squares of A x - b, by their products and b' b."""
    return float(total - 2.0 * right @ x + x @ gram @ x)
