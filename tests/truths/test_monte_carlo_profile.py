"""Monte Carlo profiles in the form of `RadialProfile`."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.truths.slab_mc import monte_carlo_profile
from dermis.optics.media import Layer, Medium, published_media
from dermis.optics.tissue import load_tissue


def test_relative_to_entering_light_in_rings() -> None:
    monte_carlo: list[tuple[int, int]] = []
    profile = monte_carlo_profile(
        published_media()["dj3"],
        photons=40_000,
        seed=3,
        progress=lambda done, total: monte_carlo.append((done, total)),
    )
    assert profile.total_error is not None and profile.standard_error is not None
    reference = np.array([0.47244, 0.38236, 0.28576])  # from 12 million photons, per entering power
    assert (np.abs(profile.total - reference) < 4.0 * profile.total_error).all()
    assert profile.ring_energy.sum(axis=0) == pytest.approx(profile.total, rel=0.01)
    assert profile.reflectance.shape == profile.standard_error.shape == (len(profile.radius_mm), 3)
    assert (np.diff(profile.radius_mm) > 0.0).all() and not profile.finite_at_centre
    assert monte_carlo and monte_carlo[-1][0] == monte_carlo[-1][1]


def test_dropped_light_is_reported() -> None:
    """Without absorption some photons would never leave."""
    lost = monte_carlo_profile(published_media()["spectralon"].channel(1), photons=2_000)
    assert any("dropped" in text for text in lost.warnings)
    assert not monte_carlo_profile(published_media()["skin1"].channel(0), photons=2_000).warnings


def test_light_beyond_the_rings_is_reported() -> None:
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
