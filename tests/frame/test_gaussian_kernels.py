"""Sampled Gaussian kernels: exact in sum and variance, and no wider than their taps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from tolerances import KERNEL_VARIANCE

from dermis.frame.features.diffusion.kernels import (
    KERNEL_TRUNCATION_SIGMAS,
    MAX_TABLE_VARIANCE,
    ROWS_PER_UNIT_VARIANCE,
    kernel_ratio_table,
    taps_per_side,
)

VARIANCES = [0.001, 0.02, 0.3, 0.5, 0.999, 1.0, 1.7, 2.3, 4.0, 6.5, 8.99, 9.0]


def kernel(variance: float) -> NDArray[np.float64]:
    """Return the (2 taps + 1,) normalised weights for a variance [step^2], as the shader finds them."""
    taps = taps_per_side(variance)
    row = variance * ROWS_PER_UNIT_VARIANCE
    low, high = kernel_ratio_table().astype(np.float64)[[int(row), int(row) + 1], taps]
    n = np.arange(-taps, taps + 1)
    weights = (low + (high - low) * (row % 1.0)) ** (n**2)
    return np.asarray(weights / weights.sum())


@pytest.mark.parametrize("variance", VARIANCES)
def test_sum_and_variance(variance: float) -> None:
    weights = kernel(variance)
    n = np.arange(len(weights)) - len(weights) // 2
    assert weights.sum() == pytest.approx(1.0, abs=1e-12)
    assert (weights * n**2).sum() == pytest.approx(variance, abs=KERNEL_VARIANCE)
    assert np.array_equal(weights, weights[::-1]) and (weights >= 0).all()


@pytest.mark.parametrize("variance", VARIANCES)
def test_taps_reach_the_truncation(variance: float) -> None:
    assert taps_per_side(variance) == math.ceil(KERNEL_TRUNCATION_SIGMAS * math.sqrt(variance))
    assert len(kernel(variance)) == 2 * taps_per_side(variance) + 1


def test_zero_variance_does_not_blur() -> None:
    assert kernel(0.0).tolist() == [1.0]


@pytest.mark.parametrize("variance", [1.0, 4.0, 9.0])
def test_wide_kernel_matches_the_gaussian(variance: float) -> None:
    weights = kernel(variance)
    n = np.arange(len(weights)) - len(weights) // 2
    exact = np.exp(-(n**2) / (2 * variance)) / math.sqrt(2 * math.pi * variance)
    assert np.abs(weights - exact).max() < 0.01 * exact.max()


def test_table_covers_the_widest_kernel() -> None:
    """The last two rows of the table are read too, and each column used there holds a ratio in 0..1."""
    table = kernel_ratio_table()
    assert table.shape == (
        MAX_TABLE_VARIANCE * ROWS_PER_UNIT_VARIANCE + 2,
        taps_per_side(MAX_TABLE_VARIANCE) + 1,
    )
    assert ((table >= 0) & (table <= 1)).all()
