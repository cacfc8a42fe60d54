"""Fits of one Gaussian."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.optics.fits.gaussian import single_gaussian
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile


def misfit(one: GaussianSum, profile: GaussianSum) -> float:
    """Return the sum over channels of the integral of r (R - S)^2, by quadrature [1/mm2]."""
    r = np.linspace(0, 30, 60_001)
    squared = (one.radiant_exitance(r) - profile.radiant_exitance(r)) ** 2
    return float(np.trapezoid(r[:, None] * squared, r, axis=0).sum())


def test_one_gaussian_is_found_again() -> None:
    profile = GaussianSum("one", np.array([0.7]), np.array([[0.3, 0.5, 0.9]]))
    assert single_gaussian(profile).variance_mm2 == pytest.approx([0.7], rel=1e-4)


def test_no_other_width_is_nearer() -> None:
    profile = load_profile("gpu-gems-3")
    best = single_gaussian(profile)
    assert np.allclose(best.albedo, profile.albedo)
    for factor in (0.9, 1.1):
        other = GaussianSum("other", factor * best.variance_mm2, best.weight)
        assert misfit(other, profile) > misfit(best, profile)
