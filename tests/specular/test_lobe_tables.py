"""The surface lobe against independent tables, and its own laws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from tolerances import PUBLISHED, TABLE_ALBEDO, TABLE_LOBE

from dermis.specular.albedo import albedo_table, directional_albedo
from dermis.specular.beckmann import beckmann, beckmann_table
from dermis.specular.fresnel import SKIN_F0, schlick
from dermis.specular.kelemen import kelemen

Floats = NDArray[np.float64]
Z = np.array([0.0, 0.0, 1.0])


def towards(theta: Floats, phi: Floats) -> Floats:
    """(n, 3) unit vectors at angles from +Z and around it [deg]."""
    t, p = np.radians(theta), np.radians(phi)
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)


@pytest.fixture(scope="module")
def tables(sample_folder: Path) -> Path:
    return sample_folder / "reference" / "data"


def test_schlick_is_the_published_column(tables: Path) -> None:
    cosine, _, _, printed = np.loadtxt(tables / "fresnel_eta1.4.csv", delimiter=",", skiprows=1).T
    assert np.allclose(schlick(cosine), printed, rtol=PUBLISHED)


def test_schlick_follows_fresnel(tables: Path) -> None:
    """Schlick's curve leaves the exact one by at most 0.05, near grazing; at the front by 0.0003."""
    cosine, exact, *_ = np.loadtxt(tables / "fresnel_eta1.4.csv", delimiter=",", skiprows=1).T
    assert np.abs(schlick(cosine) - exact).max() < 0.05
    assert abs(schlick(1.0) - exact[-1]) < 3e-4


@pytest.mark.parametrize("m", [0.1, 0.2, 0.3, 0.4, 0.5])
def test_kelemen_is_the_reference_lobe(tables: Path, m: float) -> None:
    """The reference `ks` is without the 1/pi."""
    table = np.loadtxt(tables / "specular_brdf_samples.csv", delimiter=",", skiprows=1)
    rows = table[table[:, 0] == m]
    assert len(rows) > 20
    light, view = towards(rows[:, 1], 0 * rows[:, 1]), towards(rows[:, 2], rows[:, 3])
    assert np.allclose(np.pi * kelemen(Z, light, view, m), rows[:, 4], rtol=PUBLISHED, atol=1e-30)


def reference_albedo(tables: Path) -> tuple[Floats, Floats, Floats]:
    stored = np.load(tables / "specular_rho_dt.npz")
    return stored["m"], stored["cos_theta"], stored["ks"] / np.pi


def test_directional_albedo(tables: Path) -> None:
    m, cosine, rho = reference_albedo(tables)
    assert np.abs(directional_albedo(cosine[None], m[:, None]) / rho - 1).max() < 0.005


def test_albedo_table_between_its_texels(tables: Path) -> None:
    m, cosine, rho = reference_albedo(tables)
    table = albedo_table().astype(float)
    rows, columns = table.shape
    places = np.meshgrid(m * rows - 0.5, cosine * columns - 0.5, indexing="ij")
    read = map_coordinates(table, places, order=1, mode="nearest")
    assert np.abs(read / rho - 1).max() < TABLE_ALBEDO


@pytest.mark.parametrize("m", [0.1, 0.3, 0.6])
@pytest.mark.parametrize("cosine", [0.1, 0.5, 1.0])
def test_directional_albedo_is_the_lobe_integrated_over_light(m: float, cosine: float) -> None:
    """Against a plain sum over directions of light, fine enough for the narrowest lobe."""
    mu = (np.arange(1200) + 0.5) / 1200
    phi = np.pi * (np.arange(600) + 0.5) / 600
    sine = np.sqrt(1 - mu**2)
    light = np.stack(
        [
            sine[:, None] * np.cos(phi),
            sine[:, None] * np.sin(phi),
            np.broadcast_to(mu[:, None], (len(mu), len(phi))),
        ],
        axis=-1,
    )
    view = np.array([np.sqrt(1 - cosine**2), 0.0, cosine])
    total = (kelemen(Z, light, view, m) * mu[:, None]).mean() * 2 * np.pi
    assert directional_albedo(cosine, m) == pytest.approx(total, rel=0.01)


@pytest.mark.parametrize("m", [0.1, 0.3, 1.0])
def test_lobe_is_reciprocal_and_not_negative(m: float) -> None:
    rng = np.random.default_rng(5)
    light, view = (towards(rng.uniform(0, 89, 500), rng.uniform(0, 360, 500)) for _ in range(2))
    there, back = kelemen(Z, light, view, m), kelemen(Z, view, light, m)
    assert np.allclose(there, back, rtol=1e-12)
    assert (there >= 0).all()


def test_lobe_ends_at_the_horizon() -> None:
    below = towards(np.array([91.0, 120.0, 180.0]), np.array([0.0, 90.0, 0.0]))
    assert not kelemen(Z, below, towards(np.array([30.0]), np.array([0.0])), 0.5).any()


@pytest.mark.parametrize("m", [0.1, 0.3, 0.7])
def test_beckmann_slopes_integrate_to_pi(m: float) -> None:
    """A normalised distribution has 1 as its integral of D cos over the hemisphere; this one lacks 1/pi."""
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
    read = (2.0 * map_coordinates(table, places, order=1, mode="nearest")) ** 10
    exact = beckmann(cos_h, m)
    assert np.abs(read - exact).max() < TABLE_LOBE * exact.max()  # the peak, cos_h = 1, included


def test_skin_reflects_less_than_it_lets_in() -> None:
    """With rho_s = 0.18 nothing takes more than all of the light, at any angle and roughness in use."""
    cosine, m = np.meshgrid(np.linspace(0.01, 1, 60), np.linspace(0.1, 1, 10))
    assert (0.18 * directional_albedo(cosine, m)).max() < 0.2
    assert SKIN_F0 == 0.028
