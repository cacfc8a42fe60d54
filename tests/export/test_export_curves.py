"""Cumulative profiles, fits and errors against closed forms and published values."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.export.fitting import (
    cumulative_burley_profile,
    fit_burley_width,
    fit_homogeneous_medium,
    profile_error,
)
from dermis.apps.export.subject import Subject, load_subject
from dermis.base.errors import DermisError
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.half_space import half_space, tabulated_albedo

WHITE = np.ones(3)


def test_edge_response_of_a_gaussian_is_the_error_function() -> None:
    from scipy.special import erf

    sigma = np.array([0.2, 0.5, 1.3])
    curve = CumulativeProfile.from_function(lambda r: -np.expm1(-(r[:, None] ** 2) / (2.0 * sigma**2)), WHITE)
    x = np.linspace(-3.0, 3.0, 61)
    expected = 0.5 + 0.5 * erf(x[:, None] / (sigma * np.sqrt(2.0)))
    np.testing.assert_allclose(curve.edge_response(x), expected, atol=2e-4)


def test_fit_of_a_lobe_finds_its_width() -> None:
    d = np.array([1.173, 0.461, 0.05])
    np.testing.assert_allclose(fit_burley_width(cumulative_burley_profile(d, WHITE)), d, rtol=1e-5)


def test_lobe_fit_is_a_minimum(dj3: Subject) -> None:
    d = fit_burley_width(dj3.curve)
    best = profile_error(dj3.curve, cumulative_burley_profile(d, WHITE)).cdf
    for factor in (0.97, 1.03):
        assert (profile_error(dj3.curve, cumulative_burley_profile(factor * d, WHITE)).cdf > best).all()


def test_deviation_is_zero_for_equal_profiles_and_grows_with_width() -> None:
    one = cumulative_burley_profile([1.0, 0.5, 0.2], [0.5, 0.4, 0.3])
    none = profile_error(one, one)
    assert not none.cdf.any() and not none.edge.any() and not none.energy.any()
    wider = profile_error(one, cumulative_burley_profile([1.2, 0.6, 0.24], [0.55, 0.4, 0.3]))
    much = profile_error(one, cumulative_burley_profile([2.0, 1.0, 0.4], [0.5, 0.4, 0.3]))
    assert (wider.cdf > 0.03).all() and (much.cdf > wider.cdf).all() and (much.edge > wider.edge).all()
    np.testing.assert_allclose(wider.energy, [0.1, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    ("albedo", "total"),
    [(0.5, 0.05381), (0.9, 0.25739), (0.98, 0.51859), (0.995, 0.70942)],
)
def test_half_space_albedo_matches_independent_monte_carlo(albedo: float, total: float) -> None:
    curve = half_space("skin", np.full(3, albedo), WHITE)
    np.testing.assert_allclose(curve.energy, total, rtol=0.006)
    np.testing.assert_allclose(tabulated_albedo("skin", curve.energy), albedo, atol=1e-3)


def test_matched_half_space_has_the_chandrasekhar_albedo() -> None:
    """1 - H(1) sqrt(1 - a) of isotropic scattering, a = 0.9, H(1) = 1.8501."""
    total = half_space("matched", np.full(3, 0.9), WHITE).energy
    np.testing.assert_allclose(total, 0.4149, atol=0.003)


def test_one_layer_uses_monte_carlo_and_several_use_the_layer_model(skin1: Subject, dj3: Subject) -> None:
    assert (skin1.model, dj3.model, load_subject("gpu-gems-3").model) == ("montecarlo", "layered", "table")
    layered = load_subject("skin1", model="layered")
    assert layered.model == "layered"
    assert np.abs(layered.curve.fraction - skin1.curve.fraction).max() > 0.05
    np.testing.assert_allclose(layered.curve.energy, skin1.curve.energy, rtol=0.3)


def test_equivalent_medium_of_homogeneous_skin_is_unchanged(skin1: Subject) -> None:
    found = fit_homogeneous_medium(skin1.curve)
    assert skin1.tissue is not None
    layer = skin1.tissue.medium.layers[0]
    np.testing.assert_allclose(found.albedo, layer.alpha_prime, atol=1e-4)
    np.testing.assert_allclose(found.mfp_mm, layer.mean_free_path_mm, rtol=1e-3)


def test_equivalent_medium_of_layers_keeps_energy_and_reports_its_error(dj3: Subject) -> None:
    error = profile_error(dj3.curve, fit_homogeneous_medium(dj3.curve).curve)
    assert np.abs(error.energy).max() < 1e-3
    assert 0.05 < error.cdf[0] < 0.2


def test_spectral_skin_is_normalised_to_entering_light() -> None:
    skin = load_subject("medium")
    assert skin.tissue is not None
    expected = skin.tissue.profile().total
    np.testing.assert_allclose(skin.curve.energy * (1.0 - (0.4 / 2.4) ** 2), expected, rtol=1e-9)


def test_unknown_names_are_refused() -> None:
    with pytest.raises(DermisError, match="profile nosuch"):
        load_subject("nosuch")
    with pytest.raises(DermisError, match="model: expected one of montecarlo"):
        load_subject("skin1", model="guess")  # type: ignore[arg-type]
    with pytest.raises(DermisError, match="table of Gaussians"):
        load_subject("gpu-gems-3", model="layered")
    with pytest.raises(DermisError, match="profile: expected a head"):
        load_subject("skin1", profile="dj3")
