"""Nine lobes of second-order spherical harmonics as a basis of ambient light, and fits of light strengths."""

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
    """Return the radiance (..., k) of ambient lobes in given directions.

    The radiance is 1 along the axis of a lobe and 0 in the opposite direction. These lobes are the sharpest
    that spherical harmonics of second order can represent.

    lobe_axes : (k, 3) unit vectors along the axes of the lobes
    directions : (..., 3) unit vectors
    """
    return np.asarray((0.5 + 0.5 * (directions @ lobe_axes.T)) ** 2)


@cache
def lobe_directions() -> Floats:
    """Return the axes (9, 3) of nine ambient lobes, selected one by one to be linearly independent."""
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
    """Return n evenly distributed lobes as mixtures of the 9 ambient lobes of `lobe_directions`.

    The results are the weights (9, n) of the ambient lobes, and the axes (n, 3) of the distributed lobes.
    """
    towards = fibonacci_sphere(_DISTRIBUTED_LOBE_COUNT)
    samples = fibonacci_sphere(_CANDIDATE_LOBE_COUNT)
    basis, mixed = (lobe_radiance(lobes, samples) for lobes in (lobe_directions(), towards))
    weights = np.linalg.lstsq(basis, mixed, rcond=None)[0]
    return np.asarray(weights, np.float64), towards


def ambient_panorama(lobe_strengths: Floats) -> Floats:
    """Return a panorama (h, w) of ambient radiance: the weighted sum of the 9 ambient lobes, clipped at 0.

    lobe_strengths : (9,) weights of the lobes, whose axes are `lobe_directions`
    """
    texels = texel_directions(PANORAMA_ROWS, 2 * PANORAMA_ROWS)
    return np.maximum(lobe_radiance(lobe_directions(), texels) @ lobe_strengths, 0.0)


_GRAM_REGULARISATION = 1e-9


def solve_light_strengths(A: Floats, b: Floats) -> Floats:
    """Return the light strengths x (9 + k,) that minimise |A x - b|, without negative light in any direction.

    The first nine strengths belong to the ambient lobes, and the other k to suns.

    A : (m, 9 + k) radiance of pixels under each light alone, weighted by inverse standard deviations
    b : (m,) radiance of the photograph, with the same weights
    """
    return solve_normal_equations(A.T @ A, A.T @ b)


def solve_normal_equations(gram: Floats, right_hand_side: Floats) -> Floats:
    """Return the result (9 + k,) of `solve_light_strengths`, computed from the normal equations of A and b.

    gram : (9 + k, 9 + k) product A' A
    right_hand_side : (9 + k,) product A' b
    """
    from scipy.optimize import nnls

    R = np.linalg.cholesky(gram + _GRAM_REGULARISATION * np.trace(gram) * np.eye(len(gram)))
    mixing = lobe_mixing_matrix(len(gram) - AMBIENT_LOBE_COUNT)
    solution = nnls(R.T @ mixing, np.linalg.solve(R, right_hand_side))[0]
    return np.asarray(mixing @ solution)


def lobe_mixing_matrix(sun_count: int) -> Floats:
    """Return the matrix (9 + k, n + k) that converts strengths of n lobes to those of the 9 ambient lobes.

    The n lobes are evenly distributed over the sphere, see `lobe_mixtures`. As long as their strengths are
    not negative, ambient light is not negative in any direction. The strengths of k suns, which follow those
    of the lobes, stay unchanged.

    sun_count : number k of suns
    """
    weights, _ = lobe_mixtures()
    matrix = np.zeros((AMBIENT_LOBE_COUNT + sun_count, weights.shape[1] + sun_count))
    matrix[:AMBIENT_LOBE_COUNT, : weights.shape[1]] = weights
    matrix[AMBIENT_LOBE_COUNT:, weights.shape[1] :] = np.eye(sun_count)
    return matrix


def squared_residual(
    gram: Floats, right_hand_side: Floats, target_square_sum: float, light_strengths: Floats
) -> float:
    """Return the squared residual |A x - b|^2 of light strengths x, computed from the normal equations.

    gram, right_hand_side, target_square_sum : A' A, A' b and b' b for the A and b of `solve_light_strengths`
    light_strengths : (9 + k,) strengths x
    """
    return float(
        target_square_sum - 2.0 * right_hand_side @ light_strengths + light_strengths @ gram @ light_strengths
    )
