"""Basis of ambient light, nine lobes of second-order spherical harmonics, and fits of light strengths."""

from __future__ import annotations

from functools import cache

import numpy as np

from dermis.environment.panorama import texel_directions
from dermis.mesh.geometry import fibonacci_sphere
from dermis.optics.media import Floats

PANORAMA_ROWS = 32
"""Number of rows of the panoramas of ambient light."""
AMBIENT_LOBE_COUNT = 9
"""Number of spherical harmonics up to the second order, which determine diffuse shading
[RamamoorthiHanrahan2001]."""
_DISTRIBUTED_LOBE_COUNT = 48
_CANDIDATE_LOBE_COUNT = 400


def lobe_radiance(lobe_axes: Floats, directions: Floats) -> Floats:
    """Return the radiance (..., k) of ambient lobes in given directions, 1 at a lobe's axis and 0 opposite.

    These are the sharpest lobes that second-order harmonics represent.

    lobe_axes : (k, 3) unit vectors along the axes of the lobes
    directions : (..., 3) unit vectors
    """
    return np.asarray((0.5 + 0.5 * (directions @ lobe_axes.T)) ** 2)


@cache
def lobe_directions() -> Floats:
    """Return the axes (9, 3) of the nine ambient lobes, selected greedily to be linearly independent."""
    candidates = fibonacci_sphere(_CANDIDATE_LOBE_COUNT)
    selected = [int(np.argmax(candidates[:, 2]))]
    for _ in range(AMBIENT_LOBE_COUNT - 1):  # add the candidate that the selected lobes approximate worst
        basis = lobe_radiance(candidates[selected], candidates)
        residual = lobe_radiance(candidates, candidates)
        residual = residual - basis @ np.linalg.lstsq(basis, residual, rcond=None)[0]
        selected.append(int(np.argmax((residual**2).sum(axis=0))))
    return candidates[selected]


@cache
def lobe_mixtures() -> tuple[Floats, Floats]:
    """Return weights (9, n) that express n evenly distributed lobes by the 9 ambient lobes, and the n axes.

    The ambient lobes are those of `lobe_directions`. The axes of the distributed lobes have the shape (n, 3).
    """
    towards = fibonacci_sphere(_DISTRIBUTED_LOBE_COUNT)
    samples = fibonacci_sphere(_CANDIDATE_LOBE_COUNT)
    basis, mixed = (lobe_radiance(lobes, samples) for lobes in (lobe_directions(), towards))
    weights = np.linalg.lstsq(basis, mixed, rcond=None)[0]
    return np.asarray(weights, np.float64), towards


def panorama(lobe_strengths: Floats) -> Floats:
    """Return a panorama (h, w) of ambient radiance, the weighted sum of the 9 ambient lobes, at least 0.

    lobe_strengths : (9,) weights of the lobes with the axes `lobe_directions`
    """
    texels = texel_directions(PANORAMA_ROWS, 2 * PANORAMA_ROWS)
    return np.maximum(lobe_radiance(lobe_directions(), texels) @ lobe_strengths, 0.0)


_REGULARISATION = 1e-9


def solve_strengths(A: Floats, b: Floats) -> Floats:
    """Return the light strengths x (9 + k,) that minimise |A x - b| with non-negative light everywhere.

    The first nine strengths are those of ambient lobes, the others those of k suns.

    A : (m, 9 + k) radiance of pixels under each light alone, weighted by inverse standard deviations
    b : (m,) radiance of the photograph, with the same weights
    """
    return solve_normal_equations(A.T @ A, A.T @ b)


def solve_normal_equations(gram: Floats, right_side: Floats) -> Floats:
    """Return the light strengths (9 + k,) as `solve_strengths` does, from its normal equations.

    gram, right_side : (9 + k, 9 + k) A' A and (9 + k,) A' b
    """
    from scipy.optimize import nnls

    R = np.linalg.cholesky(gram + _REGULARISATION * np.trace(gram) * np.eye(len(gram)))
    mixing = mixing_matrix(len(gram) - AMBIENT_LOBE_COUNT)
    solution = nnls(R.T @ mixing, np.linalg.solve(R, right_side))[0]
    return np.asarray(mixing @ solution)


def mixing_matrix(sun_count: int) -> Floats:
    """Return the matrix (9 + k, n + k) that converts strengths of distributed lobes to ambient lobes.

    The n distributed lobes are those of `lobe_mixtures`, and the 9 ambient lobes those of `lobe_directions`;
    the strengths of k suns follow in both and do not change. Non-negative strengths of the distributed lobes
    make ambient light non-negative.

    sun_count : number k of suns
    """
    weights, _ = lobe_mixtures()
    matrix = np.zeros((AMBIENT_LOBE_COUNT + sun_count, weights.shape[1] + sun_count))
    matrix[:AMBIENT_LOBE_COUNT, : weights.shape[1]] = weights
    matrix[AMBIENT_LOBE_COUNT:, weights.shape[1] :] = np.eye(sun_count)
    return matrix


def squared_residual(
    gram: Floats, right_side: Floats, target_square_sum: float, light_strengths: Floats
) -> float:
    """Return the squared residual |A x - b|^2 of light strengths x from the normal equations.

    gram, right_side, target_square_sum : A' A, A' b and b' b, see `solve_strengths`
    light_strengths : (9 + k,) strengths x
    """
    return float(
        target_square_sum - 2.0 * right_side @ light_strengths + light_strengths @ gram @ light_strengths
    )
