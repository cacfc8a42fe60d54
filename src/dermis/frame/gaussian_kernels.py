"""Gaussian kernels at whole texels whose variance is exactly the one asked for."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
ROWS_PER_UNIT = 64
WIDEST = 9
TRUNCATION = 3.3
"""Standard deviations at which a Gaussian is cut off."""
SUMMED_TRUNCATION = 2.4
"""The same for a Gaussian that starts from a narrower one: the cut keeps its variance, and the next blur
smooths what it changes of the shape (0.014 % of an image at most)."""
NARROW = 1.5
"""Standard deviation up to which a Gaussian that starts from unblurred light may be cut off there [texel]."""
_MOST_TAPS = math.ceil(TRUNCATION * math.sqrt(WIDEST))
_BISECTIONS = 60


def taps(variance: float, truncation: float = TRUNCATION) -> int:
    """Taps on each side for a variance in units of the step squared."""
    return math.ceil(truncation * math.sqrt(variance))


@cache
def kernel_table() -> NDArray[np.float32]:
    """q = w(1) / w(0) of the kernel w(n) = q^(n^2): rows by variance (1/64 step^2), columns by taps a side.

    A Gaussian that is sampled and cut off loses variance, a narrow one most of it. So q is solved for each
    number of taps such that the kernel has the variance asked for.
    """
    variance = np.arange(WIDEST * ROWS_PER_UNIT + 2)[:, None] / ROWS_PER_UNIT
    n = np.arange(_MOST_TAPS + 1)
    inside = n[None, :] <= n[:, None]  # column of the table, tap
    low, high = np.zeros((len(variance), len(n))), np.ones((len(variance), len(n)))
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        narrow = _variance(middle, inside) < variance
        low, high = np.where(narrow, middle, low), np.where(narrow, high, middle)
    return (0.5 * (low + high)).astype(np.float32)


def kernel(variance: float, truncation: float = TRUNCATION) -> Floats:
    """(2 taps + 1,) normalised weights for a variance in units of the step squared."""
    reach = taps(variance, truncation)
    row = variance * ROWS_PER_UNIT
    low, high = kernel_table().astype(np.float64)[[int(row), int(row) + 1], reach]
    n = np.arange(-reach, reach + 1)
    weights = (low + (high - low) * (row % 1.0)) ** (n**2)
    return np.asarray(weights / weights.sum())


def _variance(q: Floats, inside: NDArray[np.bool_]) -> Floats:
    n2 = np.arange(inside.shape[1], dtype=np.float64) ** 2
    with np.errstate(under="ignore"):
        weights = np.where(inside, q[..., None] ** n2, 0.0)
    variance: Floats = 2.0 * (weights @ n2) / (2.0 * weights.sum(axis=-1) - 1.0)
    return variance
