"""Directional albedos compared with independent tables, and the tables of the shaders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from tolerances import QUADRATURE, TABLE_ALBEDO, TABLE_LOBE

from dermis.specular.albedo import albedo_table, directional_albedo
from dermis.specular.beckmann import beckmann, beckmann_table
from dermis.specular.cosines import cosines
from dermis.specular.fresnel import FRESNEL
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]
Z = np.array([0.0, 0.0, 1.0])
# Columns of the reference table: Kelemen's is without the 1/pi.
COLUMNS = {
    "kelemen": ("ks", np.pi),
    "torrance-sparrow": ("ts_vcav", 1.0),
    "torrance-sparrow-smith": ("ts_smith", 1.0),
    "blinn-phong": ("blinn_phong", 1.0),
}


@pytest.mark.parametrize("name", COLUMNS)
def test_directional_albedo_matches_the_reference(sample_folder: Path, name: str) -> None:
    stored = np.load(sample_folder / "reference" / "data" / "specular_rho_dt.npz")
    column, factor = COLUMNS[name]
    made = directional_albedo(stored["cos_theta"], stored["m"][:, None], MODELS[name].lobe)
    assert made.shape == (5, 20)
    assert np.abs(factor * made / stored[column] - 1).max() < QUADRATURE


@pytest.mark.parametrize("m", [0.1, 0.3, 0.6])
@pytest.mark.parametrize("cosine", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("name", MODELS)
def test_albedo_is_the_lobe_integrated_over_light(name: str, cosine: float, m: float) -> None:
    """Compare with a sum over light directions that resolves the narrowest lobe."""
    # the plain highlights end in a step at the horizon, where the sum is slow to settle
    mu, phi = (np.arange(1000) + 0.5) / 1000, np.pi * (np.arange(500) + 0.5) / 500
    sine = np.sqrt(1 - mu**2)
    light = np.stack(
        np.broadcast_arrays(sine[:, None] * np.cos(phi), sine[:, None] * np.sin(phi), mu[:, None]), axis=-1
    )
    view = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])
    lobe = MODELS[name].lobe
    total = (lobe(cosines(Z, light, view), m) * mu[:, None]).mean() * 2 * np.pi
    assert directional_albedo(cosine, m, lobe) == pytest.approx(total, rel=0.01)


@pytest.mark.parametrize("fresnel", FRESNEL)
@pytest.mark.parametrize("name", MODELS)
def test_no_surface_reflects_more_than_arrives(name: str, fresnel: str) -> None:
    cosine, m = np.meshgrid(np.linspace(0.01, 1, 60), np.linspace(0.05, 1, 12))
    rho = directional_albedo(cosine, m, MODELS[name].lobe, FRESNEL[fresnel])
    assert rho.min() > 0.0 and rho.max() < 1.0


def read(table: Floats, cosine: Floats, m: Floats) -> Floats:
    """Interpolate a channel of the albedo table as the shader does."""
    rows, columns = table.shape
    places = np.broadcast_arrays((np.sqrt(m) - 0.2) / 0.8 * (rows - 1), np.sqrt(cosine) * (columns - 1))
    return np.asarray(map_coordinates(table, places, order=1, mode="nearest"))


@pytest.mark.parametrize("fresnel", FRESNEL)
@pytest.mark.parametrize("name", [name for name in MODELS if "plain" not in name])
def test_albedo_table_between_its_texels(name: str, fresnel: str) -> None:
    cosine, m = np.linspace(0.05, 1.0, 39), np.linspace(0.1, 0.5, 17)[:, None]
    exact = directional_albedo(cosine, m, MODELS[name].lobe, FRESNEL[fresnel])
    made = read(albedo_table(name, fresnel)[..., 0].astype(float), cosine, m)
    assert np.abs(made / exact - 1).max() < TABLE_ALBEDO


@pytest.mark.parametrize("name", MODELS)
def test_table_contains_the_hemispherical_mean(name: str) -> None:
    x, w = np.polynomial.legendre.leggauss(64)
    mu, m = 0.5 * (x + 1), np.linspace(0.1, 0.9, 9)
    exact = (directional_albedo(mu, m[:, None], MODELS[name].lobe) * mu) @ w
    made = read(albedo_table(name)[..., 1].astype(float), np.full(9, 0.3), m)
    assert np.abs(made - exact).max() < 0.001  # of all the light


def test_tables_are_computed_once() -> None:
    assert albedo_table("phong") is albedo_table("phong")
    assert beckmann_table() is beckmann_table()


@pytest.mark.parametrize("m", [0.1, 0.3, 0.7])
def test_beckmann_slopes_integrate_to_pi(m: float) -> None:
    """Check the integral of D cos over the hemisphere, which is pi without the 1/pi of a normalised D."""
    cos_h = (np.arange(200_000) + 0.5) / 200_000
    assert (beckmann(cos_h, m) * cos_h).mean() * 2 == pytest.approx(1.0, rel=1e-4)


def test_beckmann_table_decodes() -> None:
    table = beckmann_table()
    centres = (np.arange(len(table)) + 0.5) / len(table)
    rows = centres >= 0.1
    cos_h = np.linspace(0.0, 1.0, len(table))
    exact = beckmann(cos_h[None, :], centres[rows, None])
    decoded = (2.0 * table[rows].astype(float)) ** 10
    assert np.abs(decoded - exact).max() < 1e-5 * exact.max()


@pytest.mark.parametrize("m", [0.1, 0.2, 0.3, 0.5, 1.0])
def test_beckmann_table_between_its_texels(m: float) -> None:
    table = beckmann_table().astype(float)
    cos_h = np.linspace(0.3, 1.0, 5000)
    places = [np.full(5000, m * len(table) - 0.5), cos_h * (len(table) - 1)]
    made = (2.0 * map_coordinates(table, places, order=1, mode="nearest")) ** 10
    exact = beckmann(cos_h, m)
    assert np.abs(made - exact).max() < TABLE_LOBE * exact.max()  # the peak, cos_h = 1, included
