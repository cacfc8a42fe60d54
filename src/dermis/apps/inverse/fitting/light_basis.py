"""Basis of ambient light, lobes of second-order spherical harmonics, and least squares for its strengths."""

from __future__ import annotations

from functools import cache

import numpy as np

from dermis.environment.panorama import directions
from dermis.mesh.geometry import fibonacci_sphere
from dermis.optics.media import Floats

PANORAMA_ROWS = 32
"""Of the panoramas."""
BASIS = 9
"""Spherical harmonics up to the second order: what matte shading tells of light from all around
[RamamoorthiHanrahan2001]."""
_LOBES = 48
_CANDIDATES = 400


def lobe_radiance(towards: Floats, places: Floats) -> Floats:
    """Return a radiance from 1 ahead to 0 behind, the sharpest that second-order harmonics represent.

    towards : (k, 3) unit vectors of the middles
    places : (..., 3) unit vectors
    """
    return np.asarray((0.5 + 0.5 * (places @ towards.T)) ** 2)


@cache
def lobe_directions() -> Floats:
    """Return the middles (9, 3) of a basis of lobes, chosen greedily."""
    every = fibonacci_sphere(_CANDIDATES)
    chosen = [int(np.argmax(every[:, 2]))]
    for _ in range(BASIS - 1):  # the candidate that the lobes chosen so far describe worst
        before = lobe_radiance(every[chosen], every)
        left = lobe_radiance(every, every)
        left = left - before @ np.linalg.lstsq(before, left, rcond=None)[0]
        chosen.append(int(np.argmax((left**2).sum(axis=0))))
    return every[chosen]


@cache
def lobe_mixtures() -> tuple[Floats, Floats]:
    """Return shares (9, n) of the nine lobes in n others all around, and the middles of these (n, 3)."""
    towards = fibonacci_sphere(_LOBES)
    places = fibonacci_sphere(_CANDIDATES)
    shares = np.linalg.lstsq(lobe_radiance(lobe_directions(), places), lobe_radiance(towards, places), rcond=None)[0]
    return np.asarray(shares, np.float64), towards


def panorama(strengths: Floats) -> Floats:
    """Return the radiance (h, w) of the nine lobes, clamped to 0.

    strengths : (9,)
    """
    return np.maximum(lobe_radiance(lobe_directions(), directions(PANORAMA_ROWS, 2 * PANORAMA_ROWS)) @ strengths, 0.0)


_REGULARISATION = 1e-9


def solve_strengths(A: Floats, b: Floats) -> Floats:
    """Return strengths (9 + k,) of nine lobes and k suns with non-negative light from every direction.

    A : (m, 9 + k) weighed pixels in each light alone
    b : (m,) the weighed photograph
    """
    return solve_normal_equations(A.T @ A, A.T @ b)


def solve_normal_equations(gram: Floats, right: Floats) -> Floats:
    """Return the same by A' A (9 + k, 9 + k) and A' b (9 + k,)."""
    from scipy.optimize import nnls

    R = np.linalg.cholesky(gram + _REGULARISATION * np.trace(gram) * np.eye(len(gram)))
    mixed = mixing_matrix(len(gram) - BASIS)
    found = nnls(R.T @ mixed, np.linalg.solve(R, right))[0]
    return np.asarray(mixed @ found)


def mixing_matrix(suns: int) -> Floats:
    """Return the lobes and suns (9 + k, n + k) in terms of the n lobes all around and the suns."""
    shares, _ = lobe_mixtures()
    made = np.zeros((BASIS + suns, shares.shape[1] + suns))
    made[:BASIS, : shares.shape[1]] = shares
    made[BASIS:, shares.shape[1] :] = np.eye(suns)
    return made


def squared_residual(gram: Floats, right: Floats, total: float, x: Floats) -> float:
    """Return the sum of squares of A x - b by A' A, A' b and b' b."""
    return float(total - 2.0 * right @ x + x @ gram @ x)
