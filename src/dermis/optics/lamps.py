"""Spectra of lamps: CIE illuminants and files."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from dermis.base.errors import notify, refuse
from dermis.base.number_table import read_number_table
from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import (
    LONGEST_VISIBLE_NM,
    LONGEST_WAVELENGTH_NM,
    SHORTEST_WAVELENGTH_NM,
    interpolate_spectrum,
)

LAMPS = ("D65", "A", "FL11", "LED-B3", "E")
"""CIE illuminants: daylight, incandescent, three-band fluorescent, phosphor LED, and equal energy."""
_TABULATED = {
    "D65": ("cie-1931-d65", "d65"),
    "FL11": ("illuminants", "fl11"),
    "LED-B3": ("illuminants", "led_b3"),
}
_VISIBLE_NM = np.arange(SHORTEST_WAVELENGTH_NM, LONGEST_VISIBLE_NM + 1.0, 1.0)
_TABLE_NM = _VISIBLE_NM[::5]  # wavelengths of the tables of CIE
_BAND_NM = 10.0
_MIN_SEEN_RESPONSE = 0.01  # relative to the largest response
_MIN_SIGNAL = 1e-12  # smallest signal of white by which others are divided
_D65_AT_560_NM = 100.0
_INCANDESCENT_NM = (
    1.435e7 / 2848.0
)  # second radiation constant over the temperature, as CIE defines illuminant A
_NEUTRAL_NM = 560.0
_SPECTRUM_FILE = f"one of {', '.join(LAMPS)}, or a CSV file of wavelength [nm] and relative power"


def band_power(lamp: str | Path, wavelength_nm: Floats) -> Floats:
    """Return the mean power (n,) of a lamp in triangular bands of 10 nm, as in `lamp_power` [-].

    The full width at half maximum of the bands is 10 nm.

    lamp, wavelength_nm : as in `lamp_power`
    """
    offset = np.linspace(-_BAND_NM, _BAND_NM, 2 * int(_BAND_NM) + 1)
    ends = power_ends_nm(str(lamp))
    lamp_power(lamp, wavelength_nm)  # refuses wavelengths beyond the table
    power = lamp_power(lamp, np.clip(wavelength_nm[:, None] + offset, *ends))
    return np.asarray(np.average(power, axis=1, weights=_BAND_NM - np.abs(offset)))


def xyz_weights(lamp: str | Path, wavelength_nm: Floats) -> Floats:
    """Return weights (3, n) from reflectance spectra, lit by a lamp, to CIE 1931 XYZ; Y of white is 1 [-].

    Spectra are taken as linear between the wavelengths and as constant beyond them.

    lamp : illuminant of `LAMPS`, or a CSV file of wavelength [nm] and relative power
    wavelength_nm : (n,) wavelengths of the spectra, increasing [nm]

    Source: [CIE2018].
    """
    low, high = power_ends_nm(str(lamp))
    grid = _TABLE_NM if lamp in LAMPS else _VISIBLE_NM
    grid = grid[(grid >= low) & (grid <= high)]
    observer = np.array([interpolate_spectrum("cie-1931-d65", f"{axis}_bar", grid) for axis in "xyz"])
    white = observer @ (lamp_power(lamp, grid) * np.gradient(grid))
    return np.asarray(sensor_weights(lamp, grid, observer, wavelength_nm) * (white / white[1])[:, None])


def sensor_weights(lamp: str | Path, grid_nm: Floats, sensitivity: Floats, wavelength_nm: Floats) -> Floats:
    """Return weights (c, n) from reflectance spectra, lit by a lamp, to the signals of c sensors [-].

    The signal of white is 1. Spectra are taken as linear between the wavelengths and as constant beyond them.

    lamp : illuminant of `LAMPS`, or a CSV file of wavelength [nm] and relative power
    grid_nm : (m,) wavelengths at which the sensitivities are given [nm]
    sensitivity : (c, m) responses of the sensors to light of equal power [-]
    wavelength_nm : (n,) wavelengths of the spectra, increasing [nm]
    """
    hats = np.array([np.interp(grid_nm, wavelength_nm, unit) for unit in np.eye(len(wavelength_nm))])
    weights = (sensitivity * lamp_power(lamp, grid_nm) * np.gradient(grid_nm)) @ hats.T
    return np.asarray(weights / _checked_sums(lamp, weights.sum(axis=1, keepdims=True)))


def _checked_sums(lamp: str | Path, signals: Floats) -> Floats:
    """Return the signals of sensors for white; raise DermisError if one of them is 0."""
    if not (signals > _MIN_SIGNAL).all():
        refuse(lamp, "light that each sensor sees", "the signal of white is 0", "Extend the tables")
    return signals


def read_sensitivities(path: str | Path, lamp: str | Path) -> tuple[Floats, Floats]:
    """Return wavelengths (m,) [nm] and the sensitivities (3, m) of a camera in a CSV file, every nanometre.

    The wavelengths are those of the file for which the power of the lamp is known. A warning states others
    that the camera sees.

    Raises DermisError for a file that cannot be read, and for values that are not sensitivities.
    """
    expected = "a CSV file of wavelength [nm] and the sensitivities of red, green and blue"
    table = read_number_table(path, expected, (4,), "wavelength [nm] and three sensitivities in each line")
    check_spectra(path, table)
    low, high = power_ends_nm(str(lamp))
    first, last = max(table[0, 0], low), min(table[-1, 0], high)
    if last - first < _BAND_NM:
        actual = f"got {first:g} to {last:g} nm"
        refuse(path, f"at least {_BAND_NM:g} nm at which the lamp has a known power", actual, "Extend it")
    grid = np.arange(np.ceil(first), np.floor(last) + 1.0)
    relative = table.T[1:] / table[:, 1:].max()
    response = np.array([np.interp(grid, table[:, 0], column) for column in relative])
    _checked_sums(path, response.sum(axis=1))
    seen = seen_wavelengths(table[:, 0], relative)
    if (seen < low).any() or (seen > high).any():
        notify(
            f"{path}: the camera sees {seen[0]:g} to {seen[-1]:g} nm, but the power of {lamp} is known from "
            f"{low:g} to {high:g} nm only: other light is left out"
        )
    return grid, response


def seen_wavelengths(grid_nm: Floats, sensitivity: Floats) -> Floats:
    """Return the wavelengths (k,) at which a sensor of a camera has more than 1 % of the largest response.

    grid_nm : (m,) wavelengths [nm]
    sensitivity : (c, m) responses of the sensors [-]
    """
    return np.asarray(grid_nm[sensitivity.max(axis=0) > _MIN_SEEN_RESPONSE * sensitivity.max()])


def lamp_power(lamp: str | Path, wavelength_nm: Floats) -> Floats:
    """Return the spectral power (n,) of a lamp, relative to that of D65 at 560 nm [-].

    All lamps have the luminance of D65. Between the rows of a table, the power is interpolated linearly.

    lamp : illuminant of `LAMPS`, or a CSV file of wavelength [nm] and relative power
    wavelength_nm : (n,) wavelengths [nm]

    Raises DermisError for unknown and invisible lamps, and for wavelengths outside the table of the lamp.

    Source: [CIE2018].
    """
    return _raw_power(str(lamp), np.asarray(wavelength_nm, np.float64)) * _scale(str(lamp))


def power_ends_nm(lamp: str) -> tuple[float, float]:
    """Return the shortest and the longest wavelength at which the power of a lamp is known [nm]."""
    if lamp in _TABULATED:
        return SHORTEST_WAVELENGTH_NM, LONGEST_VISIBLE_NM
    if lamp in LAMPS:
        return SHORTEST_WAVELENGTH_NM, LONGEST_WAVELENGTH_NM + _BAND_NM
    table = _read_lamp(lamp)
    return float(table[0, 0]), float(table[-1, 0])


def _scale(lamp: str) -> float:
    """Return the factor of the power of a lamp that gives it the luminance of D65."""
    observer = interpolate_spectrum("cie-1931-d65", "y_bar", _VISIBLE_NM)
    inside = _VISIBLE_NM
    if lamp not in LAMPS:
        table = _read_lamp(lamp)
        inside = np.clip(_VISIBLE_NM, table[0, 0], table[-1, 0])  # the power of daylight is tiny at both ends
    reference, own = (
        _raw_power("D65", _VISIBLE_NM),
        np.where(inside == _VISIBLE_NM, _raw_power(lamp, inside), 0.0),
    )
    return float(observer @ reference / _D65_AT_560_NM / _checked_sums(lamp, np.asarray(observer @ own)))


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


def _read_lamp(lamp: str) -> Floats:
    """Return the wavelengths and powers (n, 2) of a file."""
    file = Path(lamp)
    if file.suffix.lower() not in (".csv", ".txt", ".tsv"):
        refuse("--light-spectrum", _SPECTRUM_FILE, f"got {lamp!r}", "Choose one of them")
    return _read_lamp_table(lamp, file.stat().st_mtime_ns if file.is_file() else 0)


@lru_cache(maxsize=8)
def _read_lamp_table(lamp: str, changed_ns: int) -> Floats:
    """Return the table of `_read_lamp`.

    changed_ns : time of the last change of the file; a changed file is read again [ns]
    """
    table = read_number_table(lamp, _SPECTRUM_FILE, (2,), "wavelength [nm] and power in each line")
    check_spectra(lamp, table)
    return np.column_stack([table[:, 0], table[:, 1] / table[:, 1].max()])


def check_spectra(file_name: str | Path, table: Floats) -> None:
    """Raise DermisError unless a table (n, 1 + c) has increasing wavelengths and c spectra of light."""
    if len(table) < 2 or (np.diff(table[:, 0]) <= 0.0).any():
        refuse(file_name, "increasing wavelengths [nm] in the first column", "they are not", "Sort the lines")
    visible = (table[:, 0] >= _VISIBLE_NM[0]) & (table[:, 0] <= _VISIBLE_NM[-1])
    if (table[:, 1:] < 0.0).any() or not (table[visible, 1:] > 0.0).any(axis=0).all():
        actual = "a value is negative, or all visible ones are 0"
        refuse(file_name, "values of at least 0, some above 0 from 380 to 780 nm", actual, "Correct the file")
