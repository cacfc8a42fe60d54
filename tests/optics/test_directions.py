"""Angular response of half-spaces, against independent H functions and photon simulations."""

from __future__ import annotations

import numpy as np
import pytest
from walk import fresnel, returned

from dermis.apps.truths import half_space
from dermis.optics.angular_response import (
    DIRECTION_ROWS,
    angular_response,
    directional_reflectance,
    h_function,
    mean_single_scattering_kernel,
)

COSINES = np.array([0.0, 0.03, 0.2, 0.5, 0.8, 1.0])
MU, WEIGHT = (0.5 * (np.polynomial.legendre.leggauss(64)[0] + 1.0), np.polynomial.legendre.leggauss(64)[1])


@pytest.mark.parametrize("albedo", [0.1, 0.68, 0.96, 0.999])
def test_h_function_is_that_of_the_iteration(albedo: float) -> None:
    np.testing.assert_allclose(h_function(COSINES, albedo), half_space.h_function(COSINES, albedo), rtol=1e-4)


@pytest.mark.parametrize("albedo", [0.68, 0.96])
def test_matched_half_space_is_the_closed_form(albedo: float) -> None:
    exact = half_space.directional_albedo(COSINES, albedo)
    np.testing.assert_allclose(directional_reflectance(COSINES, albedo, 1.0), exact, atol=2e-4)
    law = angular_response(half_space.directional_albedo(1.0, albedo), 1.0)
    above = half_space.directional_albedo(1.0, albedo)
    np.testing.assert_allclose(
        law.relative_diffuse_reflectance[0] * above, half_space.diffuse_albedo(albedo), rtol=5e-4
    )
    np.testing.assert_allclose(law.single_scattering[0], albedo / (4.0 * above), rtol=5e-4)


@pytest.mark.parametrize("albedo", [0.68, 0.96])
@pytest.mark.parametrize("cosine", [1.0, 0.5, 0.15])
def test_refracting_half_space_agrees_with_photons(albedo: float, cosine: float) -> None:
    fraction, error, _ = returned(cosine, albedo, 1.4, 60_000)
    assert abs(directional_reflectance(cosine, albedo, 1.4) - fraction) < 3.5 * error


@pytest.mark.parametrize("eta", [1.0, 1.4])
def test_what_scattered_once_is_even_in_the_mean(eta: float) -> None:
    inside = np.sqrt(1.0 - (1.0 - MU**2) / eta**2)
    for cosine in (0.1, 0.6, 1.0):
        a = np.sqrt(1.0 - (1.0 - cosine**2) / eta**2)
        mean = (WEIGHT * MU / (a + inside)).sum()
        np.testing.assert_allclose(mean_single_scattering_kernel(cosine, eta), mean, rtol=2e-4)
    law = angular_response([0.5], eta)
    np.testing.assert_allclose(
        law.mean_kernel, (WEIGHT * MU * mean_single_scattering_kernel(MU, eta)).sum(), rtol=1e-4
    )


def test_law_is_nearer_to_the_exact_one_than_a_diffuse_surface() -> None:
    """Radiance of an index-matched half-space of red skin is compared for all pairs of directions."""
    albedo = 0.9585
    above = float(half_space.directional_albedo(1.0, albedo))
    law = angular_response([above], 1.0)
    exact = np.pi * half_space.reflected_radiance(MU[:, None], MU, albedo)
    table = np.interp(np.sqrt(MU), np.linspace(0.0, 1.0, DIRECTION_ROWS), law.relative_reflectance[:, 0])
    turned = law.single_scattering[0] * (
        1.0 / (MU[:, None] + MU) - mean_single_scattering_kernel(MU, 1.0)[:, None]
    )
    ours = above * (table[:, None] + turned)

    def error(made: np.ndarray) -> float:
        weight = np.outer(WEIGHT * MU, WEIGHT * MU)
        return float(np.sqrt((weight * (made - exact) ** 2).sum() / (weight * exact**2).sum()))

    assert error(ours) < 0.03
    assert error(np.full_like(exact, above)) > 0.15


def test_white_skin_returns_everything_from_anywhere() -> None:
    np.testing.assert_allclose(angular_response([1.0], 1.4).relative_reflectance, 1.0, atol=1e-3)


def test_black_skin_has_a_law_of_its_own() -> None:
    assert np.isfinite(angular_response([0.0], 1.4).relative_reflectance).all()


def test_photons_leave_a_refracting_half_space_as_told() -> None:
    """Light enters at 81 degrees; radiance is by quarters of the squared exit cosine."""
    albedo, cosine = 0.68, 0.15
    _, _, walked = returned(cosine, albedo, 1.4, 400_000)
    law = angular_response([float(directional_reflectance(1.0, albedo, 1.4))], 1.4)
    square = (np.arange(400) + 0.5) / 400
    a, b = (np.sqrt(1.0 - (1.0 - c2) / 1.4**2) for c2 in (cosine**2, square))
    entering = np.interp(
        np.sqrt(cosine), np.linspace(0.0, 1.0, DIRECTION_ROWS), law.relative_reflectance[:, 0]
    )
    factor = (
        1.0
        + law.single_scattering[0] * (1.0 / (a + b) - mean_single_scattering_kernel(cosine, 1.4)) / entering
    )

    def quarters(radiance: np.ndarray) -> np.ndarray:
        passed = (radiance * (1.0 - fresnel(b, 1.4))).reshape(4, 100).mean(axis=1)
        return passed / passed.sum()

    def error(radiance: np.ndarray) -> float:
        return float(np.abs(quarters(radiance) / (walked / walked.sum()) - 1.0).max())

    assert error(factor) < 0.04  # what scattered often is not quite even either
    assert error(factor) < 0.7 * error(np.ones_like(b))
