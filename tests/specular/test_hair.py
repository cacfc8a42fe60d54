"""Hair scattering: energy conservation, colour by pigments, and symmetry."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.base import citations as cite
from dermis.specular.hair import (
    LONGITUDINAL_ROUGHNESS,
    absorption_per_mm,
    azimuthal_logistic,
    fibre_parameters,
    fibre_scattering,
    lobe_fractions,
    longitudinal_scattering,
)

Floats = NDArray[np.float64]
ENERGY = 1e-4
"""Of light over all directions, which bands of angles add up."""
ANGLES = np.radians([-75.0, -40.0, 0.0, 10.0, 55.0, 80.0])


def bands(count: int, low: float, high: float) -> tuple[Floats, float]:
    """Return the centres of intervals and their width."""
    step = (high - low) / count
    return low + step * (np.arange(count) + 0.5), step


def albedo(sin_o: float, depth: Floats, roughness: float = LONGITUDINAL_ROUGHNESS) -> Floats:
    """Return the radiance (3,) under uniform light."""
    (sines, ds), (phi, dphi) = bands(1000, -1, 1), bands(60, -np.pi, np.pi)
    i, p = np.meshgrid(sines, phi, indexing="ij")
    return np.asarray(
        fibre_scattering(i, sin_o, p, depth, fibre_parameters(roughness)).sum(axis=(0, 1)) * ds * dphi
    )


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("roughness", [0.2, 0.3, 0.9])
def test_white_hair_conserves_energy(angle: float, roughness: float) -> None:
    assert albedo(np.sin(angle), np.zeros(3), roughness) == pytest.approx(np.ones(3), abs=ENERGY)


@pytest.mark.parametrize("angle", ANGLES)
def test_shares_of_the_lobes_add_up(angle: float) -> None:
    h = np.linspace(-0.999, 0.999, 101)
    white = sum(lobe_fractions(np.sin(angle), np.zeros(3), h))
    assert np.allclose(white, 1.0)
    dark = sum(lobe_fractions(np.sin(angle), np.array([0.1, 1.0, 10.0]), h))
    assert (np.diff(dark, axis=-1) < 0).all() and (dark < 1).all()


@pytest.mark.parametrize("variance", fibre_parameters().variance)
def test_longitudinal_term_conserves_energy_and_is_reciprocal(variance: float) -> None:
    sines, step = bands(20_000, -1, 1)
    for angle in ANGLES:
        assert longitudinal_scattering(sines, np.sin(angle), variance).sum() * step == pytest.approx(
            1.0, abs=1e-5
        )
    i, o = np.random.default_rng(0).uniform(-1, 1, (2, 500))
    assert np.allclose(longitudinal_scattering(i, o, variance), longitudinal_scattering(o, i, variance))


def test_azimuthal_term_conserves_energy() -> None:
    phi, step = bands(5000, -np.pi, np.pi)
    for width in (0.05, 0.27, 2.0):
        assert azimuthal_logistic(phi + 9.0, width).sum() * step == pytest.approx(1.0, abs=1e-6)


def test_lobe_is_symmetric() -> None:
    rng = np.random.default_rng(1)
    (i, o), phi = rng.uniform(-0.99, 0.99, (2, 300)), rng.uniform(-np.pi, np.pi, 300)
    depth = np.array([0.2, 0.5, 1.0])
    assert np.allclose(
        fibre_scattering(i, o, phi, depth, fibre_parameters()),
        fibre_scattering(i, o, -phi, depth, fibre_parameters()),
    )


def test_pigments_colour_hair() -> None:
    """Compare blond, brown and black; pheomelanin alone is redder."""
    usual = 0.04  # mm
    seen = [albedo(0.1, usual * absorption_per_mm(much, 0.0)) for much in (0.3, 1.3, 8.0)]
    assert (np.diff(seen, axis=0) < 0).all()
    red = albedo(0.1, usual * absorption_per_mm(0.0, 2.0))
    assert red[0] / red[2] > 1.5 and (np.diff(red) < 0).all()
    assert np.allclose(usual * absorption_per_mm(1.0, 0.0), [0.419, 0.697, 1.37])


def test_sources_are_in_the_bibliography() -> None:
    assert {"Marschner2003", "dEon2011", "Chiang2016"} <= cite.citation_keys()
