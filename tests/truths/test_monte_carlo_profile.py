"""Counted profiles in the form of the models'."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.truths.slab_mc import monte_carlo_profile
from dermis.optics.media import Layer, Medium, media
from dermis.optics.tissue import load_tissue


def test_per_entering_light_in_rings() -> None:
    seen: list[tuple[int, int]] = []
    profile = monte_carlo_profile(
        media()["dj3"], photons=40_000, seed=3, progress=lambda done, total: seen.append((done, total))
    )
    assert profile.total_error is not None and profile.standard_error is not None
    truth = np.array([0.47244, 0.38236, 0.28576])  # 12 million photons, per power that entered
    assert (np.abs(profile.total - truth) < 4.0 * profile.total_error).all()
    assert profile.ring_energy.sum(axis=0) == pytest.approx(profile.total, rel=0.01)
    assert profile.reflectance.shape == profile.standard_error.shape == (len(profile.radius_mm), 3)
    assert (np.diff(profile.radius_mm) > 0.0).all() and not profile.finite_at_centre
    assert seen and seen[-1][0] == seen[-1][1]


def test_light_that_was_given_up_is_told() -> None:
    """Without absorption some photons would walk for ever."""
    lost = monte_carlo_profile(media()["spectralon"].channel(1), photons=2_000)
    assert any("given up" in text for text in lost.warnings)
    assert not monte_carlo_profile(media()["skin1"].channel(0), photons=2_000).warnings


def test_light_beyond_the_rings_is_told() -> None:
    wide = Medium("thin air", (Layer(np.array([1e-3]), np.array([0.05])),))
    assert any(
        "beyond the widest radius" in text for text in monte_carlo_profile(wide, photons=2_000).warnings
    )


def test_spectra_become_colour_with_errors() -> None:
    tissue = load_tissue("light")
    profile = monte_carlo_profile(tissue.medium, tissue.rgb, photons=4_000, seed=3)
    assert profile.incident and profile.total.shape == (3,)
    assert profile.total_error is not None
    model = tissue.profile().total
    assert (np.abs(profile.total - model) < 4.0 * profile.total_error + 0.02 * model).all()
