"""Absorption and scattering spectra of skin, and the conversion of spectra to colours under D65."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.errors import refuse
from dermis.base.tables import float_columns, read_rows
from dermis.optics.media import Floats

SHORTEST_WAVELENGTH_NM, LONGEST_WAVELENGTH_NM, LONGEST_VISIBLE_NM = 380.0, 1000.0, 780.0
"""Limits of the spectra of tissue, and upper limit of visible light [nm]."""

WAVELENGTHS_NM: Floats = np.arange(400.0, 701.0, 10.0)
"""Wavelengths (31,) of the spectra that are converted to colours [nm]."""
WAVELENGTHS_NM.setflags(write=False)

_PRIMARIES_XY = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])  # red, green, blue; CIE 1931 x, y
_NM_PER_MM = 1e6
_MM_PER_CM = 10.0
_HAEMOGLOBIN_MOL_PER_LITRE = 150.0 / 64500.0  # in whole blood: 150 g/l of 64500 g/mol [mol/l]
ScatteringLaw = Callable[[ArrayLike], Floats]
"""Function from wavelengths [nm] to the reduced scattering of the epidermis [1/mm]."""
_WATER_FRACTION, _LIPID_FRACTION = 0.65, 0.1
DERMIS_SCATTERING_RATIO: Final = 0.5
"""Scattering coefficient of the dermis relative to the epidermis, after [DonnerJensen2006] [-]."""


def visible_wavelengths(wavelength_nm: ArrayLike) -> Floats:
    """Check that wavelengths are visible, and return them as an array [nm].

    Raises DermisError unless all wavelengths are from 380 to 780 nm.
    """
    return _checked_wavelengths(wavelength_nm, LONGEST_VISIBLE_NM, "Use wavelengths of visible light")


def tissue_wavelengths(wavelength_nm: ArrayLike) -> Floats:
    """Check that wavelengths are in the range of the spectra of tissue, and return them as an array [nm].

    Raises DermisError unless all wavelengths are from 380 to 1000 nm.
    """
    return _checked_wavelengths(wavelength_nm, LONGEST_WAVELENGTH_NM, "Use visible or near-infrared light")


def _checked_wavelengths(wavelength_nm: ArrayLike, longest_nm: float, advice: str) -> Floats:
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    inside = (wavelength >= SHORTEST_WAVELENGTH_NM) & (wavelength <= longest_nm)
    if not inside.all():
        expected = f"{SHORTEST_WAVELENGTH_NM:g} to {longest_nm:g} nm"
        refuse("wavelength", expected, f"got {wavelength[~inside].flat[0]:g} nm", advice)
    return wavelength


def interpolate_spectrum(table_name: str, column_name: str, wavelength_nm: ArrayLike) -> Floats:
    """Return values of a spectrum in data/spectra, interpolated linearly, in the unit of the file.

    table_name : name of the file, without folder and suffix
    column_name : heading of the column with the spectrum
    wavelength_nm : wavelengths from 380 to the end of the table, at most 1000, an array of any shape [nm]
    """
    columns = _spectrum_columns(table_name)
    ends_visible = columns["wavelength_nm"][-1] < LONGEST_WAVELENGTH_NM
    wavelength = visible_wavelengths(wavelength_nm) if ends_visible else tissue_wavelengths(wavelength_nm)
    return np.asarray(np.interp(wavelength, columns["wavelength_nm"], columns[column_name]))


def rgb_weights(wavelength_nm: Floats = WAVELENGTHS_NM) -> Floats:
    """Return the matrix (3, n) that converts reflectance spectra, lit by D65, to linear Rec. 709 [-].

    A constant spectrum of 1 becomes white. Spectra are taken as linear between the wavelengths and as
    constant beyond them. Some elements are negative, because monochromatic colours are outside Rec. 709.

    wavelength_nm : (n,) wavelengths of the spectra, increasing, from 380 to 780 [nm]

    Source: [CIE2004] for the CIE 1931 observer and D65, [SRGB1999] for the primaries.
    """
    grid = visible_wavelengths(wavelength_nm)
    if grid.ndim != 1 or len(grid) == 0 or (np.diff(grid) <= 0.0).any():
        refuse("wavelengths", "a list that increases", f"got {grid.tolist()}", "Sort it without repetitions")
    fine = _spectrum_columns("cie-1931-d65")["wavelength_nm"]
    hats = np.array([np.interp(fine, grid, unit) for unit in np.eye(len(grid))])
    weights = np.linalg.solve(_primaries_xyz(), _weighted_colour_matching() @ hats.T)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _weighted_colour_matching() -> Floats:
    """Return the CIE 1931 colour-matching functions (3, 81), each multiplied by the spectrum of D65."""
    columns = _spectrum_columns("cie-1931-d65")
    return np.array([columns[name] for name in ("x_bar", "y_bar", "z_bar")]) * columns["d65"]


def _primaries_xyz() -> Floats:
    """Return a matrix (3, 3) with the XYZ colours of the Rec. 709 primaries as columns, each with Y = 1."""
    x, y = _PRIMARIES_XY.T
    return np.array([x / y, np.ones(3), (1.0 - x - y) / y])


@cache
def _spectrum_columns(table_name: str) -> dict[str, Floats]:
    rows = read_rows("dermis.optics", f"data/spectra/{table_name}")
    return {name: float_columns(rows, name)[:, 0] for name in rows[0]}


def eumelanin_absorption(wavelength_nm: ArrayLike) -> Floats:
    """Return the absorption coefficient of melanosomes with eumelanin, which is brown to black [1/mm].

    Source: [Jacques1998], as in [DonnerJensen2006].
    """
    return np.asarray(6.6e10 * tissue_wavelengths(wavelength_nm) ** -3.33)


def pheomelanin_absorption(wavelength_nm: ArrayLike) -> Floats:
    """Return the absorption coefficient of melanosomes with pheomelanin, which is yellow to red [1/mm].

    Source: [DonnerJensen2006], as quoted by public code.
    """
    return np.asarray(2.9e14 * tissue_wavelengths(wavelength_nm) ** -4.75)


def melanosome_absorption(wavelength_nm: ArrayLike, eumelanin_fraction: float) -> Floats:
    """Return the absorption coefficient of melanosomes with a mixture of eumelanin and pheomelanin [1/mm].

    wavelength_nm : wavelengths from 380 to 1000 [nm]
    eumelanin_fraction : fraction of the melanosomes that contain eumelanin, 0 to 1 [-]

    Source: [DonnerJensen2006].
    """
    dark, light = eumelanin_absorption(wavelength_nm), pheomelanin_absorption(wavelength_nm)
    return eumelanin_fraction * dark + (1.0 - eumelanin_fraction) * light


def baseline_absorption(wavelength_nm: ArrayLike) -> Floats:
    """Return the absorption coefficient of skin without blood and melanin, measured on rats [1/mm].

    Source: [Jacques1998] section 1.1.
    """
    return np.asarray(0.0244 + 8.53 * np.exp(-(tissue_wavelengths(wavelength_nm) - 154.0) / 66.2))


def oxyhaemoglobin_extinction(wavelength_nm: ArrayLike) -> Floats:
    """Return the decadic molar extinction coefficient of oxygenated haemoglobin [1/(cm M)].

    Source: [Prahl1999].
    """
    return interpolate_spectrum("haemoglobin", "oxyhaemoglobin", wavelength_nm)


def deoxyhaemoglobin_extinction(wavelength_nm: ArrayLike) -> Floats:
    """Return the decadic molar extinction coefficient of haemoglobin without oxygen [1/(cm M)].

    Source: [Prahl1999].
    """
    return interpolate_spectrum("haemoglobin", "deoxyhaemoglobin", wavelength_nm)


def blood_absorption(wavelength_nm: ArrayLike, oxygen: float) -> Floats:
    """Return the absorption coefficient of whole blood [1/mm].

    wavelength_nm : wavelengths from 380 to 1000 [nm]
    oxygen : fraction of oxygenated haemoglobin, 0 to 1 [-]

    Source: [Prahl1999].
    """
    extinction = oxygen * oxyhaemoglobin_extinction(wavelength_nm) + (
        1.0 - oxygen
    ) * deoxyhaemoglobin_extinction(wavelength_nm)
    return np.asarray(np.log(10.0) * _HAEMOGLOBIN_MOL_PER_LITRE * extinction / _MM_PER_CM)


def water_absorption(wavelength_nm: ArrayLike) -> Floats:
    """Return the absorption coefficient of water, 4 pi k / lambda [1/mm].

    Here, k is the imaginary part of the index of refraction.

    Source: [HaleQuerry1973].
    """
    k = interpolate_spectrum("water", "k", wavelength_nm)
    return np.asarray(4.0 * np.pi * k * _NM_PER_MM / tissue_wavelengths(wavelength_nm))


def lipid_absorption(wavelength_nm: ArrayLike) -> Floats:
    """Return the absorption coefficient of mammalian fat [1/mm].

    Below 430 nm, it is that at 430 nm.

    Source: [VanVeen2004].
    """
    return interpolate_spectrum("lipid", "absorption_per_mm", wavelength_nm)


def infrared_absorption(wavelength_nm: ArrayLike) -> Floats:
    """Return the absorption coefficient of water and lipids in tissue minus that at 700 nm [1/mm].

    It is 0 up to 700 nm, because `baseline_absorption` was measured on moist tissue and includes water.

    Source: [Jacques2013] for the water content of 65 %; the lipid content of 10 % is chosen.
    """
    added = _water_and_lipids(wavelength_nm) - _water_and_lipids(WAVELENGTHS_NM[-1])
    return np.asarray(
        np.where(tissue_wavelengths(wavelength_nm) > WAVELENGTHS_NM[-1], np.maximum(added, 0.0), 0.0)
    )


def _water_and_lipids(wavelength_nm: ArrayLike) -> Floats:
    return _WATER_FRACTION * water_absorption(wavelength_nm) + _LIPID_FRACTION * lipid_absorption(
        wavelength_nm
    )


def donner_jensen_scattering(wavelength_nm: ArrayLike) -> Floats:
    """Return the reduced scattering coefficient of the epidermis after [DonnerJensen2006] [1/mm].

    The unit could not be checked against the paper. It is taken to be 1/mm, because half of this coefficient,
    which is used for the dermis, then equals the scattering of skin in [Bashkatov2005].

    Source: [DonnerJensen2006], as quoted by public code.
    """
    wavelength = tissue_wavelengths(wavelength_nm)
    return np.asarray(14.74 * wavelength**-0.22 + 2.2e11 * wavelength**-4.0)


def jacques_scattering(wavelength_nm: ArrayLike) -> Floats:
    """Return the reduced scattering coefficient of skin after [Jacques1998] [1/mm].

    The law is the sum of Mie scattering by large fibres and Rayleigh scattering by small fibres. It is the
    same for epidermis and dermis.
    """
    wavelength = tissue_wavelengths(wavelength_nm)
    return np.asarray(2e4 * wavelength**-1.5 + 2e11 * wavelength**-4.0)
