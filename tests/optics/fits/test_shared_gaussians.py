"""Fits of several profiles with shared Gaussians."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.optics.fits.gaussian import SHARED_GAUSSIAN_COUNT, _combined_ring_target, shared_gaussians
from dermis.optics.profiles import load_profile


@pytest.mark.parametrize(
    ("names", "most"),
    # photons' blue profile of skin1 is steeper at its centre than six Gaussians for all three can be
    [(("skin1", "skin2"), 0.1), (("gpu-gems-3", "dj3", "skin1"), 0.18)],
)
def test_each_keeps_its_total_and_its_shape(names: tuple[str, ...], most: float) -> None:
    profiles = [load_profile(name) for name in names]
    shared = shared_gaussians(profiles)
    for before, after in zip(profiles, shared, strict=True):
        assert len(after.variance_mm2) <= SHARED_GAUSSIAN_COUNT
        np.testing.assert_array_equal(after.variance_mm2, shared[0].variance_mm2)
        np.testing.assert_allclose(after.albedo, before.albedo, rtol=1e-9)
        assert _combined_ring_target([before]).error(after.variance_mm2, after.weight).max() < most


def test_profiles_that_share_theirs_are_taken_as_they_are() -> None:
    one = load_profile("skin1")
    assert all(after is one for after in shared_gaussians([one, one]))
