"""Basis of ambient light, as lobes of second-order spherical harmonics, and fits of its strengths."""

from __future__ import annotations

from functools import cache

import numpy as np

from dermis.environment.panorama import directions
from dermis.mesh.geometry import fibonacci_sphere
from dermis.optics.media import Floats

PANORAMA_ROWS = 32
"""Rows of the panoramas."""
BASIS = 9
"""Number of spherical harmonics up to the second order, which determine diffuse shading
[RamamoorthiHanrahan2001]."""
_LOBES = 48
_CANDIDATES = 400


def lobe_radiance(towards: Floats, directions: Floats) -> Floats:
    """Return the radiance (..., k) of lobes, 1 in their direction and 0 opposite.

    These are the sharpest lobes that second-order harmonics represent.

    towards : (k, 3) unit vectors of the lobes
    directions : (..., 3) unit vectors
    """
    return np.asarray((0.5 + 0.5 * (directions @ towards.T)) ** 2)


@cache
def lobe_directions() -> Floats:
    """Return the directions (9, 3) of a basis of lobes, chosen greedily."""
    candidates = fibonacci_sphere(_CANDIDATES)
    selected = [int(np.argmax(candidates[:, 2]))]
    for _ in range(BASIS - 1):  # add the candidate that the selected lobes approximate worst
        basis = lobe_radiance(candidates[selected], candidates)
        residual = lobe_radiance(candidates, candidates)
        residual = residual - basis @ np.linalg.lstsq(basis, residual, rcond=None)[0]
        selected.append(int(np.argmax((residual**2).sum(axis=0))))
    return candidates[selected]


@cache
def lobe_mixtures() -> tuple[Floats, Floats]:
    """Return weights (9, n) of the nine lobes in n evenly distributed lobes, and their directions (n, 3)."""
    towards = fibonacci_sphere(_LOBES)
    samples = fibonacci_sphere(_CANDIDATES)
    basis, mixed = (lobe_radiance(lobes, samples) for lobes in (lobe_directions(), towards))
    weights = np.linalg.lstsq(basis, mixed, rcond=None)[0]
    return np.asarray(weights, np.float64), towards


def panorama(strengths: Floats) -> Floats:
    """Return the radiance (h, w) of the nine lobes, clamped to 0.

    strengths : (9,)
    """
    texels = directions(PANORAMA_ROWS, 2 * PANORAMA_ROWS)
    return np.maximum(lobe_radiance(lobe_directions(), texels) @ strengths, 0.0)


_REGULARISATION = 1e-9


def solve_strengths(A: Floats, b: Floats) -> Floats:
    """Return strengths (9 + k,) of nine lobes and k suns, with non-negative light from every direction.

    A : (m, 9 + k) weighted pixels under each light alone
    b : (m,) weighted photograph
    """
    return solve_normal_equations(A.T @ A, A.T @ b)


def solve_normal_equations(gram: Floats, right: Floats) -> Floats:
    """Return the strengths of `solve_strengths` from A' A (9 + k, 9 + k) and A' b (9 + k,)."""
    from scipy.optimize import nnls

    R = np.linalg.cholesky(gram + _REGULARISATION * np.trace(gram) * np.eye(len(gram)))
    mixing = mixing_matrix(len(gram) - BASIS)
    solution = nnls(R.T @ mixing, np.linalg.solve(R, right))[0]
    return np.asarray(mixing @ solution)


def mixing_matrix(suns: int) -> Floats:
    """Return the matrix (9 + k, n + k) from n distributed lobes and k suns to the nine lobes and the suns."""
    weights, _ = lobe_mixtures()
    matrix = np.zeros((BASIS + suns, weights.shape[1] + suns))
    matrix[:BASIS, : weights.shape[1]] = weights
    matrix[BASIS:, weights.shape[1] :] = np.eye(suns)
    return matrix


def squared_residual(gram: Floats, right: Floats, total: float, x: Floats) -> float:
    """Return the sum of squares of A x - b from A' A, A' b and b' b."""
    return float(total - 2.0 * right @ x + x @ gram @ x)
