"""Spectra: tables by wavelength, and the linear Rec. 709 colour of a spectrum under D65."""

from __future__ import annotations

from functools import cache

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
