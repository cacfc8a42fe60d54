"""Spectra of lamps: CIE illuminants and files."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from dermis.base.errors import refuse
from dermis.base.number_table import read_number_table
from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import LONGEST_VISIBLE_NM, interpolate_spectrum

LAMPS = ("D65", "A", "FL11", "LED-B3", "E")
"""CIE illuminants: daylight, incandescent, three-band fluorescent, phosphor LED, and equal energy."""
_TABULATED = {"D65": ("cie-1931-d65", "d65"), "FL11": ("illuminants", "fl11"), "LED-B3": ("illuminants", "led_b3")}
_VISIBLE_NM = np.arange(380.0, LONGEST_VISIBLE_NM + 1.0, 1.0)
_D65_AT_560_NM = 100.0
_INCANDESCENT_NM = 1.435e7 / 2848.0  # second radiation constant over the temperature, as CIE defines illuminant A
_NEUTRAL_NM = 560.0
_SPECTRUM_FILE = f"one of {', '.join(LAMPS)}, or a CSV file of wavelength [nm] and relative power"


def lamp_power(lamp: str | Path, wavelength_nm: Floats) -> Floats:
    """Return the spectral power (n,) of a lamp, relative to that of D65 at 560 nm [-].

    All lamps have the luminance of D65. Between the rows of a table, the power is interpolated linearly.

    lamp : illuminant of `LAMPS`, or a CSV file of wavelength [nm] and relative power
    wavelength_nm : (n,) wavelengths [nm]

    Raises DermisError for unknown lamps, and for wavelengths outside the table of the lamp.

    Source: [CIE2018].
    """
    return _raw_power(str(lamp), np.asarray(wavelength_nm, np.float64)) * _scale(str(lamp))


@cache
def _scale(lamp: str) -> float:
    """Return the factor of the power of a lamp that gives it the luminance of D65."""
    observer = interpolate_spectrum("cie-1931-d65", "y_bar", _VISIBLE_NM)
    inside = _VISIBLE_NM
    if lamp not in LAMPS:
        table = _read_lamp(lamp)
        inside = np.clip(_VISIBLE_NM, table[0, 0], table[-1, 0])  # the power of daylight is tiny at both ends
    reference, own = _raw_power("D65", _VISIBLE_NM), np.where(inside == _VISIBLE_NM, _raw_power(lamp, inside), 0.0)
    return float(observer @ reference / _D65_AT_560_NM / (observer @ own))


def _raw_power(lamp: str, wavelength_nm: Floats) -> Floats:
    """Return the spectral power (n,) of a lamp in the unit of its table."""
    if lamp == "E":
        return np.ones_like(wavelength_nm)
    if lamp == "A":
        planck = (_NEUTRAL_NM / wavelength_nm) ** 5 * np.expm1(_INCANDESCENT_NM / _NEUTRAL_NM)
        return np.asarray(planck / np.expm1(_INCANDESCENT_NM / wavelength_nm))
    if lamp in _TABULATED:
        if (wavelength_nm > LONGEST_VISIBLE_NM).any():
            expected = f"wavelengths up to {LONGEST_VISIBLE_NM:g} nm, where the table of {lamp} ends"
            actual = f"got {wavelength_nm.max():g} nm"
            refuse("--light-spectrum", expected, actual, "Choose A or E, or give a file of the lamp")
        return interpolate_spectrum(*_TABULATED[lamp], wavelength_nm)
    table = _read_lamp(lamp)
    if wavelength_nm.min() < table[0, 0] or wavelength_nm.max() > table[-1, 0]:
        expected = f"power at {wavelength_nm.min():g} to {wavelength_nm.max():g} nm"
        refuse(lamp, expected, f"it has {table[0, 0]:g} to {table[-1, 0]:g} nm", "Extend the table")
    return np.interp(wavelength_nm, table[:, 0], table[:, 1])


@cache
def _read_lamp(lamp: str) -> Floats:
    """Return the wavelengths and powers (n, 2) of a file."""
    if Path(lamp).suffix.lower() not in (".csv", ".txt", ".tsv"):
        refuse("--light-spectrum", _SPECTRUM_FILE, f"got {lamp!r}", "Choose one of them")
    table = read_number_table(lamp, _SPECTRUM_FILE, (2,), "wavelength [nm] and power in each line")
    check_spectra(lamp, table)
    return table


def check_spectra(file_name: str | Path, table: Floats) -> None:
    """Raise DermisError unless a table (n, 1 + c) has increasing wavelengths and c spectra of light."""
    if len(table) < 2 or (np.diff(table[:, 0]) <= 0.0).any():
        refuse(file_name, "increasing wavelengths [nm] in the first column", "they are not", "Sort the lines")
    visible = (table[:, 0] >= _VISIBLE_NM[0]) & (table[:, 0] <= _VISIBLE_NM[-1])
    if (table[:, 1:] < 0.0).any() or not (table[visible, 1:] > 0.0).any(axis=0).all():
        actual = "a value is negative, or all visible ones are 0"
        refuse(file_name, "values of at least 0, some above 0 from 380 to 780 nm", actual, "Correct the file")
