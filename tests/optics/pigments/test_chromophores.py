"""Chromophores and scattering laws: published tables and values, isosbestic points, and ranges."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike
from tolerances import PUBLISHED

from dermis.base.errors import DermisError
from dermis.optics.media import Floats
from dermis.optics.pigments import spectra as chromophores

VISIBLE_NM = np.arange(380.0, 781.0)


def reference(sample_folder: Path) -> np.ndarray:
    path = sample_folder / "reference" / "data" / "spectral_coefficients.csv"
    return np.genfromtxt(path, delimiter=",", names=True)


def crossings(values: Floats) -> Floats:
    """Return wavelengths at which values on the visible nanometres change sign."""
    i = np.flatnonzero(np.diff(np.sign(values)))
    return VISIBLE_NM[i] + values[i] / (values[i] - values[i + 1])


def test_haemoglobin_is_the_published_table(sample_folder: Path) -> None:
    table = np.loadtxt(sample_folder / "reference" / "data" / "prahl_hemoglobin.csv", skiprows=2)
    wavelength, oxy, deoxy = table[(table[:, 0] >= 380) & (table[:, 0] <= 1000)].T
    assert len(wavelength) == 311
    assert np.array_equal(chromophores.oxyhaemoglobin_extinction(wavelength), oxy)
    assert np.array_equal(chromophores.deoxyhaemoglobin_extinction(wavelength), deoxy)


@pytest.mark.parametrize(
    ("extinction", "wavelength", "published"),
    [
        (chromophores.oxyhaemoglobin_extinction, 415, 523100),
        (chromophores.oxyhaemoglobin_extinction, 540, 53240),
        (chromophores.oxyhaemoglobin_extinction, 575, 54425),
        (chromophores.oxyhaemoglobin_extinction, 660, 319.6),
        (chromophores.deoxyhaemoglobin_extinction, 555, 54530),
        (chromophores.deoxyhaemoglobin_extinction, 660, 3227),
    ],
)
def test_haemoglobin_at_its_bands(
    extinction: Callable[[ArrayLike], Floats], wavelength: float, published: float
) -> None:
    """Expected values are from another tabulation, to four digits."""
    assert extinction(wavelength) == pytest.approx(published, rel=2e-4)


def test_coefficients_of_an_independent_computation(sample_folder: Path) -> None:
    table = reference(sample_folder)
    wavelength = table["lambda_nm"]
    for name, column in [
        (chromophores.oxyhaemoglobin_extinction, "eps_HbO2_cm1_M1"),
        (chromophores.deoxyhaemoglobin_extinction, "eps_Hb_cm1_M1"),
        (chromophores.eumelanin_absorption, "mua_melanosome_mm1"),
        (chromophores.baseline_absorption, "mua_baseline_mm1"),
        (chromophores.jacques_scattering, "musp_mm1"),
    ]:
        assert np.allclose(name(wavelength), table[column], rtol=PUBLISHED, atol=0.0), column


def test_blood_of_an_independent_computation(sample_folder: Path) -> None:
    """The independent computation uses 2.303 for ln 10."""
    table = reference(sample_folder)
    computed = chromophores.blood_absorption(table["lambda_nm"], 0.75) * 2.303 / np.log(10.0)
    assert np.allclose(computed, table["mua_blood_S075_mm1"], rtol=PUBLISHED, atol=0.0)


def test_isosbestic_points() -> None:
    """Oxygenation does not change absorption at the five wavelengths given in textbooks."""
    difference = chromophores.oxyhaemoglobin_extinction(
        VISIBLE_NM
    ) - chromophores.deoxyhaemoglobin_extinction(VISIBLE_NM)
    found = crossings(difference)
    for published in (500.0, 529.0, 545.0, 570.0, 584.0):
        assert np.abs(found - published).min() < 2.0
    full, none = chromophores.blood_absorption(660.0, 1.0), chromophores.blood_absorption(660.0, 0.0)
    assert none > 5.0 * full  # venous blood is dark red


def test_melanin_of_both_kinds() -> None:
    """Pheomelanin absorbs blue relatively more, so it looks red."""
    blue, red = 450.0, 650.0
    brown = chromophores.melanosome_absorption([blue, red], 1.0)
    ginger = chromophores.melanosome_absorption([blue, red], 0.0)
    assert ginger[0] / ginger[1] > 1.5 * brown[0] / brown[1]
    assert np.allclose(chromophores.melanosome_absorption([blue, red], 0.25), 0.25 * brown + 0.75 * ginger)


def test_water_as_measured() -> None:
    """Absorption is 0.0060 per cm at 700 nm, and small compared with tissue."""
    assert chromophores.water_absorption(700.0) == pytest.approx(6.0e-4, rel=5e-3)
    up_to_700 = VISIBLE_NM[VISIBLE_NM <= 700.0]
    assert (
        chromophores.water_absorption(up_to_700) < 0.03 * chromophores.baseline_absorption(up_to_700)
    ).all()


def test_scattering_in_the_reading_per_millimetre() -> None:
    """It is 6.08 per mm at 550 nm; half of it is the law published for the dermis."""
    assert chromophores.donner_jensen_scattering(550.0) == pytest.approx(6.08, abs=0.005)
    others_per_cm = 73.7 * VISIBLE_NM**-0.22 + 1.1e12 * VISIBLE_NM**-4.0
    dermis = chromophores.DERMIS_SCATTERING_RATIO * chromophores.donner_jensen_scattering(VISIBLE_NM)
    assert np.allclose(10.0 * dermis, others_per_cm, rtol=PUBLISHED)


@pytest.mark.parametrize("law", [chromophores.donner_jensen_scattering, chromophores.jacques_scattering])
def test_skin_scatters_blue_more(law: chromophores.ScatteringLaw) -> None:
    assert (np.diff(law(VISIBLE_NM)) < 0.0).all()


@pytest.mark.parametrize("wavelength", [379.9, 1000.1, np.nan, [500.0, 1100.0]])
@pytest.mark.parametrize(
    "spectrum",
    [
        chromophores.eumelanin_absorption,
        chromophores.pheomelanin_absorption,
        chromophores.baseline_absorption,
        chromophores.oxyhaemoglobin_extinction,
        chromophores.deoxyhaemoglobin_extinction,
        chromophores.water_absorption,
        chromophores.lipid_absorption,
        chromophores.infrared_absorption,
        chromophores.donner_jensen_scattering,
        chromophores.jacques_scattering,
    ],
)
def test_invisible_light_is_refused(spectrum: Callable[[ArrayLike], Floats], wavelength: ArrayLike) -> None:
    with pytest.raises(DermisError, match="380 to 1000 nm"):
        spectrum(wavelength)


def test_results_have_the_shape_of_the_wavelengths() -> None:
    grid = np.linspace(400.0, 700.0, 6).reshape(2, 3)
    assert (
        chromophores.blood_absorption(grid, 0.5).shape == chromophores.water_absorption(grid).shape == (2, 3)
    )
    assert chromophores.melanosome_absorption(500.0, 0.5).shape == ()
