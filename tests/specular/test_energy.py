"""Energy conservation between surface reflection and skin: the white furnace."""

from __future__ import annotations

import numpy as np
import pytest
import twins
from numpy.typing import NDArray
from tolerances import FURNACE

from dermis.specular.albedo import directional_albedo
from dermis.specular.cosines import cosines
from dermis.specular.fresnel import ENERGY_SCHEMES, EnergyConservationScheme
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]
VIEWS = np.linspace(0.02, 1.0, 99)
Z = np.array([0.0, 0.0, 1.0])


def mean_albedo(m: float, model: str = "kelemen") -> float:
    x, w = np.polynomial.legendre.leggauss(48)
    mu = 0.5 * (x + 1)
    return float(w @ (directional_albedo(mu, m, MODELS[model].lobe) * mu))


def furnace(
    energy: EnergyConservationScheme, views: Floats, m: float, rho_s: float, model: str = "kelemen"
) -> Floats:
    rho = directional_albedo(views, m, MODELS[model].lobe)
    return energy.furnace_radiance(rho, mean_albedo(m, model), rho_s)


def test_published_scheme_loses_the_measured_energy() -> None:
    """Check strength 0.18 and m = 0.3: 0.96 overall and 0.85 at grazing angles, 0.99 if divided by pi."""
    ends = furnace(ENERGY_SCHEMES["published"], np.array([1.0, 0.05]), 0.3, 0.18)
    assert ends == pytest.approx([0.96, 0.85], abs=0.005)
    divided = furnace(
        EnergyConservationScheme(1.0, returns_internal_light=False), np.array([1.0, 0.05]), 0.3, 0.18
    )
    assert divided == pytest.approx([0.99, 0.99], abs=0.005)


def test_omitting_the_term_creates_energy() -> None:
    assert (furnace(ENERGY_SCHEMES["none"], VIEWS, 0.3, 0.18) > 1.0).all()


@pytest.mark.parametrize("m", [0.1, 0.3, 0.5])
@pytest.mark.parametrize("model", MODELS)
def test_full_scheme_conserves_energy(model: str, m: float) -> None:
    """Check the shader's tables: no view above 1.01, the mean within 1 %."""
    rho = directional_albedo(VIEWS, m, MODELS[model].lobe)
    table, mean = twins.surface_albedo(VIEWS, m, model)
    for rho_s in (0.18, 1.0):
        entered = 1.0 - rho_s * mean_albedo(m, model)
        out = rho_s * rho + entered * ENERGY_SCHEMES["full"].exitance_factor(table, mean, rho_s)
        assert out.max() < 1.0 + FURNACE
        assert abs((out * VIEWS).sum() / VIEWS.sum() - 1.0) < FURNACE


@pytest.mark.parametrize("view", [0.1, 0.6, 1.0])
@pytest.mark.parametrize("model", ["kelemen", "torrance-sparrow", "two-lobe"])
def test_furnace_test_per_light_direction(model: str, view: float) -> None:
    """Sum the whole reflection over light directions, without a quadrature of the model."""
    m, rho_s, energy = 0.35, 0.7, ENERGY_SCHEMES["full"]
    mu, phi = (np.arange(500) + 0.5) / 500, np.pi * (np.arange(240) + 0.5) / 240
    sine = np.sqrt(1 - mu**2)
    light = np.stack(
        np.broadcast_arrays(sine[:, None] * np.cos(phi), sine[:, None] * np.sin(phi), mu[:, None]), -1
    )
    eye = np.array([np.sqrt(1 - view**2), 0.0, view])
    mirrored = rho_s * MODELS[model].lobe(cosines(Z, light, eye), m)
    entering = energy.entering_fraction(directional_albedo(mu, m, MODELS[model].lobe), rho_s)[:, None]
    leaving = energy.exitance_factor(
        directional_albedo(view, m, MODELS[model].lobe), mean_albedo(m, model), rho_s
    )
    out = 2 * np.pi * ((mirrored + entering * leaving / np.pi) * mu[:, None]).mean()
    assert out == pytest.approx(1.0, abs=0.005)


def test_dark_skin_is_not_lighter_than_its_colour() -> None:
    """Check that light reflected back inside is dimmed by the skin once."""
    m, rho_s, colour = 0.3, 1.0, 0.2
    rho, mean = directional_albedo(VIEWS, m), mean_albedo(m)
    below = (1 - rho_s * mean) * colour * ENERGY_SCHEMES["full"].exitance_factor(rho, mean, rho_s)
    assert (below * VIEWS).sum() / VIEWS.sum() == pytest.approx(colour * (1 - mean), rel=0.002)


def test_published_term_is_clamped_at_zero() -> None:
    assert ENERGY_SCHEMES["published"].entering_fraction(0.5, 1.0) == 0.0
