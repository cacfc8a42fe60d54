"""Burley's profile: closed forms, fits to photon counts, and parameters of engines."""

from __future__ import annotations

import json
from dataclasses import asdict

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j0
from tolerances import CLOSED_FORM

from dermis.base.errors import DermisError
from dermis.optics.fits.burley import (
    BurleyProfile,
    fit_burley,
    shape_factor,
    shape_factor_diffuse,
    unity_parameters,
    unreal_parameters,
)
from dermis.optics.fits.targets import RingTarget

EDGES = np.append(0.0, np.geomspace(1e-3, 60.0, 120))
PROFILE = BurleyProfile(np.array([0.6, 0.4, 0.2]), np.array([0.8, 2.0, 4.5]))


def rings_of(profile: BurleyProfile) -> RingTarget:
    return RingTarget(EDGES, np.diff(profile.energy_within(EDGES), axis=0), profile.albedo)


def test_light_within_a_radius_is_the_integral() -> None:
    for i in range(3):
        ring = quad(lambda r, i=i: 2 * np.pi * r * PROFILE.radiant_exitance(r)[i], 1e-12, 1.7)[0]
        assert PROFILE.energy_within(1.7)[i] == pytest.approx(ring, rel=CLOSED_FORM)
    assert np.allclose(PROFILE.energy_within(1e3), PROFILE.albedo, rtol=1e-12)


def test_transform_by_quadrature() -> None:
    assert np.allclose(PROFILE.hankel(0.0), PROFILE.albedo, rtol=1e-12)
    for i in range(3):
        wave = quad(
            lambda r, i=i: 2 * np.pi * r * PROFILE.radiant_exitance(r)[i] * j0(1.3 * r),
            1e-12,
            80.0,
            limit=400,
        )[0]
        assert PROFILE.hankel(1.3)[i] == pytest.approx(wave, rel=1e-5)


@pytest.mark.parametrize("fraction", [1e-6, 0.3, 0.9, 0.997, 1 - 1e-9])
def test_radius_at_fraction_encloses_that_fraction(fraction: float) -> None:
    radius = PROFILE.radius_at_fraction(fraction)
    held = PROFILE.energy_within(radius).diagonal() / PROFILE.albedo
    assert np.allclose(held, fraction, rtol=CLOSED_FORM)


def test_published_scaling_laws() -> None:
    """Expected factors are computed by hand."""
    assert np.allclose(shape_factor([0.0, 0.3, 0.8, 1.0]), [5.434, 2.425, 1.05, 0.906])
    assert np.allclose(shape_factor_diffuse([0.33, 0.83, 1.33]), [3.5, 9.75, 103.5])


def test_shape_is_found_again() -> None:
    found = fit_burley(rings_of(PROFILE))
    assert np.allclose(found.profile.shape, PROFILE.shape, rtol=CLOSED_FORM)
    assert (found.error < CLOSED_FORM).all() and (found.energy_error == 0.0).all()


def test_fit_has_the_least_error(counted_skin: RingTarget) -> None:
    found = fit_burley(counted_skin)
    for factor in (0.98, 1.02):
        moved = BurleyProfile(found.profile.albedo, factor * found.profile.shape)
        through = np.diff(moved.energy_within(counted_skin.edges_mm), axis=0)
        error = np.linalg.norm(through - counted_skin.energy, axis=0) / np.linalg.norm(
            counted_skin.energy, axis=0
        )
        assert (error > found.error).all()
    assert (found.error < 0.12).all()


def test_unity_shows_the_radius_of_the_widest_channel() -> None:
    unity = unity_parameters(PROFILE)
    distance = unity.multiplier_mm * np.array(unity.scattering_colour)
    assert np.allclose(1.0 / distance, PROFILE.shape)
    assert max(unity.scattering_colour) == 1.0
    left = 0.25 * np.exp(-unity.max_radius_mm * 0.8) + 0.75 * np.exp(-unity.max_radius_mm * 0.8 / 3)
    assert left == pytest.approx(0.003, rel=CLOSED_FORM)


@pytest.mark.parametrize("size", [1.0, 0.05])
def test_unreal_makes_the_same_shape_of_its_parameters(size: float) -> None:
    """The engine converts the mean free path to the diffuse mean free path, and that to s."""
    profile = BurleyProfile(PROFILE.albedo, PROFILE.shape / size)
    unreal = unreal_parameters(profile)
    assert unreal.mean_free_path_distance_cm >= 0.1
    A = np.array(unreal.surface_albedo)
    mean_free_path_cm = unreal.mean_free_path_distance_cm * np.array(unreal.mean_free_path_colour)
    search_light, perpendicular = 3.5 + 100 * (A - 0.33) ** 4, 1.85 - A + 7 * abs(A - 0.8) ** 3
    diffuse_mm = mean_free_path_cm * search_light / perpendicular * 10 / 0.6
    assert np.allclose(search_light / diffuse_mm, profile.shape)
    assert max(unreal.mean_free_path_colour) <= 1.0


def test_unreal_parameters_of_counted_skin_come_near_the_engines_own_preset(counted_skin: RingTarget) -> None:
    """The engine's Skin1 is 0.1295 cm times (1, 0.735, 0.518), 1 / sigma_t' of the same medium.

    Blue, with an albedo of 0.11, is outside the range of the law.
    """
    unreal = unreal_parameters(fit_burley(counted_skin).profile)
    ours = unreal.mean_free_path_distance_cm * np.array(unreal.mean_free_path_colour)
    preset = 0.1295 * np.array([1.0, 0.735, 0.518])
    assert np.allclose(ours[:2], preset[:2], rtol=0.03)
    assert ours[2] == pytest.approx(preset[2], rel=0.25)


def test_parameters_can_be_written_as_json() -> None:
    for parameters in (unity_parameters(PROFILE), unreal_parameters(PROFILE)):
        assert json.loads(json.dumps(asdict(parameters))).keys() == asdict(parameters).keys()


def test_engines_take_three_channels() -> None:
    grey = BurleyProfile(np.array([0.5]), np.array([1.0]))
    with pytest.raises(DermisError, match="red, green and blue"):
        unity_parameters(grey)
    with pytest.raises(DermisError, match="1 channels"):
        unreal_parameters(grey)
