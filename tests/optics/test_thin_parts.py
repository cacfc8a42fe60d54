"""Thin parts: the equivalent medium, amounts, widths and directions."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.optics.angular_response import angular_response
from dermis.optics.diffusion.boundary import fresnel
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.equivalent_medium import equivalent_medium
from dermis.optics.fits.gaussian import fit_gaussians
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Layer, Medium, published_media
from dermis.optics.slabs import solve_slabs
from dermis.optics.thin_parts import THICKNESS_ROWS, oblique_transmittance, solve_thin_parts

BODY = published_media()["skin1"].with_eta(1.0)
REACH = 12.0
DEPTH = REACH * np.linspace(0.0, 1.0, THICKNESS_ROWS) ** 2


@pytest.fixture(scope="module")
def profile() -> GaussianSum:
    return fit_gaussians(diffusion_profile(BODY).ring_target(), 6, profile_name="skin1").profile


def test_a_profile_tells_its_medium(profile: GaussianSum) -> None:
    found, body = equivalent_medium(profile, profile.albedo, 1.0).layers[0], BODY.layers[0]
    assert found.alpha_prime == pytest.approx(body.alpha_prime, rel=0.01)
    assert found.sigma_t_prime == pytest.approx(body.sigma_t_prime, rel=0.02)


def test_what_passes_from_any_direction(profile: GaussianSum) -> None:
    """The error for red is at most a sixth of normal incidence, from 1 to 8 mm and up to 70 degrees."""
    made = solve_thin_parts(BODY, profile.variance_mm2, REACH)
    layer, law = BODY.layers[0], oblique_transmittance(profile.albedo, 1.0)[:, 0]
    cosine = np.cos(np.radians([0.0, 30.0, 50.0, 70.0]))
    whole = solve_slabs(float(layer.alpha_prime[0]), 1e4, 1.0)
    back = np.interp(cosine, whole.cosine, whole.reflected[0])
    slant = np.interp(np.sqrt(cosine), np.linspace(0.0, 1.0, len(law)), law)
    for thickness in (1.0, 2.0, 4.0, 8.0):
        fraction = np.interp(thickness, DEPTH, made.transmitted[..., 0].sum(axis=1))
        deep = np.interp(thickness, DEPTH, made.directionality)
        cut = solve_slabs(float(layer.alpha_prime[0]), float(layer.sigma_t_prime[0]) * thickness, 1.0)
        exact = np.interp(cosine, cut.cosine, cut.transmitted[0])
        found = fraction * back * (1.0 + deep * (slant - 1.0))
        assert np.abs(found - exact).max() < exact[0] / 6.0, thickness


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_amounts_are_those_of_slabs_cut_one_by_one(profile: GaussianSum, eta: float) -> None:
    """Expected values use twice as many cosines, and one solution per thickness."""
    body = published_media()["skin1"].with_eta(eta)
    made, layer = solve_thin_parts(body, profile.variance_mm2, REACH), body.layers[0]
    for c in range(3):
        albedo, extinction = float(layer.alpha_prime[c]), float(layer.sigma_t_prime[c])
        cut, whole = solve_slabs(albedo, extinction * DEPTH[1:], eta), solve_slabs(albedo, 1e4, eta)
        returned = whole.reflected @ whole.flux
        assert made.transmitted[1:, :, c].sum(axis=1) == pytest.approx(
            cut.transmitted @ cut.flux / returned, abs=1e-3
        )
        lost = 1.0 - cut.reflected @ cut.flux / returned
        assert made.lost[1:, :, c].sum(axis=1) == pytest.approx(lost, abs=1e-3)


def test_light_that_a_white_medium_lets_pass_is_lost_to_its_near_side() -> None:
    white = Medium("white", (Layer(np.array([1e-6]), np.array([2.0])),), 1.0)
    made = solve_thin_parts(white, np.array([0.01, 0.1, 1.0, 10.0]), 8.0)
    through, lost = made.transmitted[1:, :, 0].sum(axis=1), made.lost[1:, :, 0].sum(axis=1)
    clear = DEPTH[1:] / REACH * 8.0 > 4.0  # beyond, nothing passes unscattered
    assert (lost >= through - 5e-3).all()
    assert lost[clear] == pytest.approx(through[clear], abs=5e-3)


def test_nothing_passes_deep_in_dark_flesh() -> None:
    """Transmittance is below the smallest double."""
    dark = Medium("dark", (Layer(np.array([40.0]), np.array([10.0])),), 1.4)
    made = solve_thin_parts(dark, np.array([0.01, 0.1, 1.0, 100.0]), 40.0)
    assert (
        np.isfinite(made.transmitted).all()
        and np.isfinite(made.lost).all()
        and np.isfinite(made.directionality).all()
    )
    assert made.transmitted[-5:].max() < 1e-12 and made.lost[-5:].max() < 1e-6


def test_thicker_parts_spread_light_wider() -> None:
    variance = np.array([0.05, 0.5, 5.0, 20.0])
    made = solve_thin_parts(BODY.channel(0), variance, REACH).transmitted[1:, :, 0]
    width = made @ variance / made.sum(axis=1)
    assert (np.diff(width)[4:] > -0.02 * width[5:]).all() and width[-1] > 10.0 * width[4]


def test_directions_cancel_in_uniform_light() -> None:
    """The mean of `oblique_transmittance` over uniform light is 1."""
    for eta in (1.0, 1.4):
        law = oblique_transmittance(np.array([0.5]), eta)[:, 0]
        cosine = np.linspace(0.0, 1.0, len(law)) ** 2
        fine = np.linspace(1e-3, 1.0, 2001)
        returned = np.interp(
            np.sqrt(fine), np.sqrt(cosine), angular_response([0.5], eta).relative_reflectance[:, 0]
        )
        weight = returned * fine * (1.0 - fresnel(fine, eta))
        mean = (weight * np.interp(np.sqrt(fine), np.sqrt(cosine), law)).sum() / weight.sum()
        assert mean == pytest.approx(1.0, abs=0.01)
