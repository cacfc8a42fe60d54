"""Spectra: tables by wavelength, absorption of chromophores, and colours under D65."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.errors import refuse
from dermis.base.tables import numbers, read_rows
from dermis.optics.media import Floats

SHORTEST_NM, LONGEST_NM = 380.0, 780.0

WAVELENGTHS_NM: Floats = np.arange(400.0, 701.0, 10.0)
"""The grid for colours, (31,) [nm]. Against 5 nm steps, 380 to 780, skin is 0.0001 off, at worst 0.0011."""
WAVELENGTHS_NM.setflags(write=False)

_PRIMARIES = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])  # red, green, blue; CIE 1931 x, y
_NM_PER_MM = 1e6
_MM_PER_CM = 10.0
_HAEMOGLOBIN_MOLAR = 150.0 / 64500.0  # in whole blood: 150 g/l of 64500 g/mol [mol/l]
ScatteringLaw = Callable[[ArrayLike], Floats]
"""From wavelengths [nm] to the reduced scattering of the epidermis [1/mm]."""
DERMIS_SHARE: Final = 0.5
"""Scattering of the dermis over that of the epidermis, after [DonnerJensen2006] [-]."""


def visible(wavelength_nm: ArrayLike) -> Floats:
    """Wavelengths as an array [nm].

    Raises DermisError when one of them is not from 380 to 780 nm.
    """
    wavelength = np.asarray(wavelength_nm, dtype=np.float64)
    within = (wavelength >= SHORTEST_NM) & (wavelength <= LONGEST_NM)
    if not within.all():
        expected, came = f"{SHORTEST_NM:g} to {LONGEST_NM:g} nm", f"{wavelength[~within].flat[0]:g} nm came"
        refuse("wavelength", expected, came, "Give wavelengths of visible light")
    return wavelength


def tabulated(table: str, column: str, wavelength_nm: ArrayLike) -> Floats:
    """A column of the table data/spectra/`table`.csv, linear between its rows, in the table's unit.

    wavelength_nm : (...) from 380 to 780 [nm]
    """
    columns = _read(table)
    return np.asarray(np.interp(visible(wavelength_nm), columns["wavelength_nm"], columns[column]))


def rgb_weights(wavelength_nm: Floats = WAVELENGTHS_NM) -> Floats:
    """Matrix (3, n) that takes a spectrum to linear Rec. 709; the spectrum 1 becomes (1, 1, 1) [-].

    Between the wavelengths the spectrum is taken as linear, beyond them as constant. Some weights are
    negative, because pure wavelengths lie outside Rec. 709.

    wavelength_nm : (n,) increasing, from 380 to 780 [nm]

    Source: [CIE2004] for the observer of 1931 and D65, [SRGB1999] for the primaries.
    """
    grid = visible(wavelength_nm)
    if grid.ndim != 1 or len(grid) == 0 or (np.diff(grid) <= 0.0).any():
        refuse("wavelengths", "a list that increases", f"{grid.tolist()} came", "Sort it without repetitions")
    fine = _read("cie-1931-d65")["wavelength_nm"]
    hats = np.array([np.interp(fine, grid, one) for one in np.eye(len(grid))])
    weights = np.linalg.solve(_primaries_xyz(), _observer() @ hats.T)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _observer() -> Floats:
    """XYZ colour-matching functions times D65, (3, 81)."""
    columns = _read("cie-1931-d65")
    return np.array([columns[name] for name in ("x_bar", "y_bar", "z_bar")]) * columns["d65"]


def _primaries_xyz() -> Floats:
    """XYZ of the primaries in columns, each of luminance 1."""
    x, y = _PRIMARIES.T
    return np.array([x / y, np.ones(3), (1.0 - x - y) / y])


@cache
def _read(table: str) -> dict[str, Floats]:
    rows = read_rows("dermis.optics", f"data/spectra/{table}")
    return {name: numbers(rows, name)[:, 0] for name in rows[0]}


def eumelanin(wavelength_nm: ArrayLike) -> Floats:
    """Absorption inside a melanosome that holds the brown to black melanin [1/mm].

    Source: [Jacques1998], as in [DonnerJensen2006].
    """
    return np.asarray(6.6e10 * visible(wavelength_nm) ** -3.33)


def pheomelanin(wavelength_nm: ArrayLike) -> Floats:
    """Absorption inside a melanosome that holds the yellow to red melanin [1/mm].

    Source: [DonnerJensen2006], as quoted by public code.
    """
    return np.asarray(2.9e14 * visible(wavelength_nm) ** -4.75)


def melanosome(wavelength_nm: ArrayLike, eumelanin_share: float) -> Floats:
    """Absorption inside melanosomes of which a share holds eumelanin, the rest pheomelanin [1/mm].

    eumelanin_share : 0 to 1 [-]

    Source: [DonnerJensen2006].
    """
    brown, red = eumelanin(wavelength_nm), pheomelanin(wavelength_nm)
    return eumelanin_share * brown + (1.0 - eumelanin_share) * red


def baseline(wavelength_nm: ArrayLike) -> Floats:
    """Absorption of skin without melanin and blood, measured on bloodless rat skin [1/mm].

    Source: [Jacques1998] section 1.1. Some code has -lambda - 154 for -(lambda - 154), which leaves little
    more than the constant.
    """
    return np.asarray(0.0244 + 8.53 * np.exp(-(visible(wavelength_nm) - 154.0) / 66.2))


def oxyhaemoglobin(wavelength_nm: ArrayLike) -> Floats:
    """Molar extinction of haemoglobin with oxygen, to base 10 [1/(cm M)].

    Source: [Prahl1999].
    """
    return tabulated("haemoglobin", "oxyhaemoglobin", wavelength_nm)


def deoxyhaemoglobin(wavelength_nm: ArrayLike) -> Floats:
    """Molar extinction of haemoglobin without oxygen, to base 10 [1/(cm M)].

    Source: [Prahl1999].
    """
    return tabulated("haemoglobin", "deoxyhaemoglobin", wavelength_nm)


def blood(wavelength_nm: ArrayLike, oxygen: float) -> Floats:
    """Absorption of whole blood [1/mm].

    oxygen : share of the haemoglobin that carries oxygen, 0 to 1 [-]

    Source: [Prahl1999].
    """
    extinction = oxygen * oxyhaemoglobin(wavelength_nm) + (1.0 - oxygen) * deoxyhaemoglobin(wavelength_nm)
    return np.asarray(np.log(10.0) * _HAEMOGLOBIN_MOLAR * extinction / _MM_PER_CM)


def water(wavelength_nm: ArrayLike) -> Floats:
    """Absorption of water: 4 pi k / lambda [1/mm].

    Up to 700 nm it is under 3 % of `baseline`, which was measured on moist tissue: no structure adds it.

    Source: [HaleQuerry1973].
    """
    k = tabulated("water", "k", wavelength_nm)
    return np.asarray(4.0 * np.pi * k * _NM_PER_MM / visible(wavelength_nm))


def donner_jensen_2006(wavelength_nm: ArrayLike) -> Floats:
    """Reduced scattering of the epidermis by the law of [DonnerJensen2006], read in 1/mm [1/mm].

    The unit could not be checked against the paper. Some read 1/cm, find a tenth of what skin scatters and
    replace the law. In 1/mm, half of it, which is the dermis', equals 73.7 lambda^-0.22 + 1.1e12 lambda^-4 in
    1/cm: the law that others give for skin after [Bashkatov2005], 3 per mm at 550 nm.

    Source: [DonnerJensen2006], as quoted by public code.
    """
    wavelength = visible(wavelength_nm)
    return np.asarray(14.74 * wavelength**-0.22 + 2.2e11 * wavelength**-4.0)


def jacques_1998(wavelength_nm: ArrayLike) -> Floats:
    """Reduced scattering of skin, large fibres and small ones (Mie and Rayleigh) [1/mm].

    Jacques has the same for epidermis and dermis.

    Source: [Jacques1998].
    """
    wavelength = visible(wavelength_nm)
    return np.asarray(2e4 * wavelength**-1.5 + 2e11 * wavelength**-4.0)
