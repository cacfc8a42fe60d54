"""Transmittance: algebra of the Gaussians, and slabs against Monte Carlo."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slabs import slab, table

from dermis.base.errors import DermisError
from dermis.optics.diffusion.models import gaussian_transmittance, slab_transmittance, truncated_medium
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import published_media
from dermis.optics.profiles import load_profile

THICK_MM = np.array([0.25, 0.5, 1.0, 2.0, 4.0, 8.0])


def test_gaussians_through_a_thickness_are_their_integral() -> None:
    """The integral is over the uniformly lit far side, at distances sqrt(r^2 + d^2)."""
    profile = load_profile("gpu-gems-3")
    r = np.linspace(0.0, 40.0, 40_001)
    for d in (0.0, 0.5, 2.0):
        bells = profile.radiant_exitance(np.sqrt(r**2 + d**2))
        integral = np.trapezoid(2 * np.pi * r[:, None] * bells, r, axis=0)
        assert gaussian_transmittance(profile, [d])[0] == pytest.approx(integral, rel=1e-5)


def test_variance_is_not_halved_nor_doubled() -> None:
    one = GaussianSum("one", np.array([2.0]), np.ones((1, 3)))
    assert gaussian_transmittance(one, [2.0])[0] == pytest.approx(np.exp(-1.0) * np.ones(3))


@pytest.mark.parametrize("name", ["dj3", "skin1", "marble"])
def test_thicker_is_darker_and_redder(name: str) -> None:
    through = slab_transmittance(published_media()[name], THICK_MM)
    assert (np.diff(through, axis=0) < 0.0).all()
    assert (through[2:, 0] > through[2:, 1]).all() and (through[2:, 1] > through[2:, 2]).all()
    assert ((through > 0.0) & (through < 1.0)).all()


def test_all_light_comes_through_next_to_nothing() -> None:
    thin = slab_transmittance(published_media()["marble"], [1e-4])[0]
    assert thin == pytest.approx(np.full(3, 1.0 - (0.4 / 2.4) ** 2), rel=2e-3)


@pytest.mark.parametrize("alpha_prime", [0.9, 0.98])
def test_slabs_of_monte_carlo(sample_folder: Path, alpha_prime: float) -> None:
    """Known errors are 7 %, and 3 % for two mean free paths of a medium with little absorption."""
    runs = table(sample_folder, "mc_totals.csv")
    for thickness in (0.5, 1.0, 2.0, 5.0):
        run = runs[runs["case"] == f"slab_a{alpha_prime:g}_d{thickness:.1f}_n1.4_g0"][0]
        entering = 1.0 - run["Rsp"]
        through = slab_transmittance(slab(alpha_prime), [thickness])[0, 0]
        bias = through * entering / run["Tt_per_incident"] - 1.0
        little = thickness >= 2.0 and alpha_prime > 0.95
        assert abs(bias) < (0.03 if little else 0.07), (thickness, bias)


def test_cut_keeps_what_is_above() -> None:
    skin = published_media()["dj3"]
    assert [layer.thickness_mm for layer in truncated_medium(skin, 0.3).layers] == pytest.approx([0.25, 0.05])
    assert [layer.name for layer in truncated_medium(skin, 5.0).layers] == [
        layer.name for layer in skin.layers
    ]
    for thickness in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(DermisError, match="above 0 mm"):
            truncated_medium(skin, thickness)
