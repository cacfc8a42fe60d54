"""Strengths of lights from a photograph: non-negative least squares, for a picture is linear in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.fitting import sky

Floats = NDArray[np.float64]
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
    mixed = mixing(len(gram) - sky.BASIS)
    found = nnls(R.T @ mixed, np.linalg.solve(R, right))[0]
    return np.asarray(mixed @ found)


def mixing(suns: int) -> Floats:
    """(9 + k, n + k) of the lobes and suns, by the n lobes of which all light from around is a sum."""
    shares, _ = sky.mixtures()
    made = np.zeros((sky.BASIS + suns, shares.shape[1] + suns))
    made[: sky.BASIS, : shares.shape[1]] = shares
    made[sky.BASIS :, shares.shape[1] :] = np.eye(suns)
    return made


def fault_by(gram: Floats, right: Floats, total: float, x: Floats) -> float:
    """Sum of squares of A x - b, by their products and b' b."""
    return float(total - 2.0 * right @ x + x @ gram @ x)
