"""Spectra to colours: the observer's table, white, an independent computation, gamut, and invalid grids."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.media import Medium
from dermis.optics.pigments.parameters import SkinParameters
from dermis.optics.pigments.skin import spectral_medium
from dermis.optics.pigments.spectra import (
    WAVELENGTHS_NM,
    interpolate_spectrum,
    jacques_scattering,
    rgb_weights,
)

FINE_NM = np.arange(380.0, 781.0, 5.0)
COLOUR = 3e-5
"""Linear colour, absolute: another quadrature, and a printed white point for the tabulated D65."""


def skins(sample_folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return reflectance spectra in steps of 5 nm, (63, 81), and their independently computed colours."""
    folder = sample_folder / "reference" / "data"
    spectra = np.load(folder / "spectral_diffusion.npz")["R"].reshape(63, 81)
    table = np.genfromtxt(
        folder / "spectral_srgb_diffusion.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
    )
    assert (table["model"] == "layered_diffusion").all()
    return spectra, np.array([table["lin_R"], table["lin_G"], table["lin_B"]]).T


@pytest.mark.parametrize(
    "grid", [WAVELENGTHS_NM, FINE_NM, np.array([550.0]), np.array([420.0, 600.0, 601.0])]
)
def test_the_spectrum_one_is_white(grid: np.ndarray) -> None:
    white = rgb_weights(grid) @ np.ones(len(grid))
    assert np.allclose(white, 1.0, rtol=0.0, atol=1e-14)


def test_observer_and_illuminant_are_the_published_tables(sample_folder: Path) -> None:
    path = sample_folder / "reference" / "data" / "spectral_coefficients.csv"
    table = np.genfromtxt(path, delimiter=",", names=True)
    for ours, theirs in [("x_bar", "xbar"), ("y_bar", "ybar"), ("z_bar", "zbar"), ("d65", "D65")]:
        column = interpolate_spectrum("cie-1931-d65", ours, table["lambda_nm"])
        assert np.allclose(column, table[theirs], rtol=1e-9, atol=1e-12), ours


def test_colours_of_skins(sample_folder: Path) -> None:
    spectra, colours = skins(sample_folder)
    assert np.abs(spectra @ rgb_weights(FINE_NM).T - colours).max() < COLOUR


def test_the_coarse_grid_is_enough(sample_folder: Path) -> None:
    spectra, colours = skins(sample_folder)
    coarse = np.array([np.interp(WAVELENGTHS_NM, FINE_NM, spectrum) for spectrum in spectra])
    assert np.abs(coarse @ rgb_weights().T - colours).max() < 1e-3


def test_whole_chain_from_pigments_to_the_colours_of_another_program(sample_folder: Path) -> None:
    """The other program has only eumelanin, 0.06 mm, and scattering after Jacques in both layers."""
    table = np.genfromtxt(
        sample_folder / "reference" / "data" / "spectral_srgb_diffusion.csv",
        delimiter=",",
        names=True,
        dtype=None,
        encoding="utf-8",
    )
    sigma_s_prime = jacques_scattering(WAVELENGTHS_NM)
    for row in table[::6]:
        skin = SkinParameters(row["f_mel"], 1.0, row["f_blood"], oxygen=0.75, epidermis_mm=0.06, baseline=1.0)
        epidermis, dermis = spectral_medium("dj2006", skin, scattering=jacques_scattering).layers
        medium = Medium("skin", (epidermis, replace(dermis, sigma_s_prime=sigma_s_prime)))
        total = diffusion_profile(medium, rgb_weights=rgb_weights()).total
        assert total == pytest.approx([row["lin_R"], row["lin_G"], row["lin_B"]], abs=6e-4)


def test_weights_are_those_of_the_srgb_standard() -> None:
    """The printed matrix of four digits, 0.0002 off white, is applied to XYZ of five spectra."""
    printed = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
    observer = np.array([interpolate_spectrum("cie-1931-d65", f"{axis}_bar", FINE_NM) for axis in "xyz"])
    light = observer * interpolate_spectrum("cie-1931-d65", "d65", FINE_NM)
    spectra = np.array([np.interp(FINE_NM, [380.0, 450.0, 550.0, 650.0, 780.0], one) for one in np.eye(5)])
    xyz = spectra @ light.T / light[1].sum()
    assert np.allclose(spectra @ rgb_weights(FINE_NM).T, xyz @ printed.T, rtol=0.0, atol=3e-4)


def test_a_pure_wavelength_is_outside_the_gamut() -> None:
    weights = rgb_weights()
    green = np.where(WAVELENGTHS_NM == 520.0, 1.0, 0.0)
    colours = np.array([weights @ green, weights @ (0.5 + 0.0 * green), [0.0, 0.0, 0.0]])
    assert (colours < 0.0).any(axis=1).tolist() == [True, False, False]


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        ([], "increases"),
        ([500.0, 500.0], "increases"),
        ([600.0, 500.0], "increases"),
        ([[500.0], [600.0]], "increases"),
        ([300.0, 500.0], "380 to 780"),
        ([500.0, np.nan], "380 to 780"),
    ],
)
def test_bad_grids_are_refused(grid: list[float], message: str) -> None:
    with pytest.raises(DermisError, match=message):
        rgb_weights(np.array(grid))
