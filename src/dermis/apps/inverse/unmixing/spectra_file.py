"""Reader of tables of reflectance spectra, and estimation of pigments from these spectra."""

from __future__ import annotations

import csv
import gzip
import math
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dermis.apps.inverse.unmixing.spectral_inversion import (
    PIGMENT_AND_OXYGEN_UNKNOWNS,
    PIGMENT_UNKNOWNS,
    SPECULAR_INCLUDED_REFLECTANCE,
    TISSUE_UNKNOWNS,
    SpectralFit,
    fit_skin,
)
from dermis.base.errors import notify, refuse
from dermis.base.quantities import checked_number
from dermis.base.reading import open_regular_file, refuse_parse_errors
from dermis.base.tables import column_separator
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters
from dermis.optics.pigments.spectra import WAVELENGTHS_NM

UNKNOWN_NAMES_BY_SET = {
    "none": PIGMENT_UNKNOWNS,
    "oxygen": PIGMENT_AND_OXYGEN_UNKNOWNS,
    "all": TISSUE_UNKNOWNS,
}
"""Dictionary from a value of `extra_unknowns` (see `unmix_spectra`) to the names of all parameters that are
fitted, including melanin and blood."""
_EXPECTED_TABLE = "a table of reflectance spectra (CSV), a spectrum in each row or in each column"
_WAVELENGTH_PATTERN = re.compile(r"[^\d.]{0,20}?(\d{3,4}(?:\.\d+)?)\s*(?:nm)?", re.IGNORECASE)
_MAX_FILE_BYTES = 32 << 20
_MIN_BAND_COUNT, _MAX_WAVELENGTH_STEP_NM, _MAX_END_GAP_NM = 16, 21.0, 5.0
_SPECTRA_PER_BATCH = 10_000  # spectra that are fitted together
_MAX_MEDIAN_REFLECTANCE = 1.5  # a table with a larger median is in percent
_MAX_REFLECTANCE = 1.5


@dataclass(frozen=True, eq=False)
class SpectraTable:
    """Reflectance spectra read from a file.

    labels : for each spectrum, a dictionary from heading to text, for all cells that are not reflectances
    reflectance : (n, 31) reflectance factors at `WAVELENGTHS_NM`, NaN for spectra with missing values [-]
    """

    labels: list[dict[str, str]]
    reflectance: Floats


def read_spectra(path: str | Path) -> SpectraTable:
    """Read a table of reflectance spectra, plain or compressed by gzip.

    The headings or the cells of the first column are wavelengths such as r400, 400 or 400 nm. Reflectance is
    interpolated linearly to wavelengths from 400 to 700 nm in steps of 10 nm. Values in percent are
    recognised. Lines that start with # are comments.

    Raises DermisError when the file is not such a table, or when its wavelengths do not cover this range.
    """
    rows = _read_table_cells(path)
    columns = {k: nm for k, cell in enumerate(rows[0]) if (nm := _parse_wavelength_nm(cell)) is not None}
    if len(columns) < _MIN_BAND_COUNT:
        rows = [list(column) for column in zip(*rows, strict=True)]
        columns = {k: nm for k, cell in enumerate(rows[0]) if (nm := _parse_wavelength_nm(cell)) is not None}
    order = sorted(columns, key=lambda k: columns[k])
    grid = np.array([columns[k] for k in order])
    _check_wavelengths(path, grid)
    body = rows[1:]
    values = np.array([[_parse_number(row[k]) for k in order] for row in body]).reshape(len(body), len(grid))
    if not np.isfinite(values).any():
        refuse(path, _EXPECTED_TABLE, "there are no numbers below the wavelengths", "Check the file")
    if np.nanmedian(values) > _MAX_MEDIAN_REFLECTANCE:
        notify(f"{path}: reflectances are read in percent")
        values = values / 100.0
    outside = np.nanmax(values) > _MAX_REFLECTANCE or np.nanmin(values) < -0.1
    if outside:
        actual = f"they are {np.nanmin(values):.3g} to {np.nanmax(values):.3g}"
        refuse(path, "reflectances from 0 to 1, or in percent", actual, "Check the columns")
    spectra = np.array([np.interp(WAVELENGTHS_NM, grid, row) for row in values])
    spectra[~np.isfinite(values).all(axis=1)] = np.nan
    heads = {k: cell or f"column {k + 1}" for k, cell in enumerate(rows[0]) if k not in columns}
    return SpectraTable([{name: row[k] for k, name in heads.items()} for row in body], spectra)


def _read_table_cells(path: str | Path) -> list[list[str]]:
    """Return the cells of a table whose rows all have the same length.

    Raises DermisError for other files.
    """
    with open_regular_file(path, _EXPECTED_TABLE) as file:
        packed = file.read(2) == b"\x1f\x8b"
        file.seek(0)
        with refuse_parse_errors(path, _EXPECTED_TABLE, OSError, EOFError, UnicodeDecodeError, zlib.error):
            data = (gzip.GzipFile(fileobj=file) if packed else file).read(_MAX_FILE_BYTES + 1)
            if len(data) > _MAX_FILE_BYTES:
                refuse(path, "at most 32 MB of text", "it has more", "Split the table")
            text = data.decode("utf-8-sig")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if len(lines) < 2:
        refuse(path, _EXPECTED_TABLE, f"it has {len(lines)} rows", "Give headings and spectra")
    separator = column_separator(lines[0])
    with refuse_parse_errors(path, _EXPECTED_TABLE, csv.Error):
        rows = list(csv.reader(lines, delimiter=separator))
    width = len(rows[0])
    for number, row in enumerate(rows[1:], 2):
        if len(row) != width:
            refuse(path, f"{width} cells in each row", f"row {number} has {len(row)}", "Correct the row")
    if separator != ",":
        rows = [[cell.replace(",", ".") for cell in row] for row in rows]
    return [[cell.strip() for cell in row] for row in rows]


def _parse_wavelength_nm(cell: str) -> float | None:
    """Return the wavelength that a heading states [nm], or None if it states no wavelength."""
    match = _WAVELENGTH_PATTERN.fullmatch(cell)
    return float(match[1]) if match and 200.0 <= float(match[1]) <= 3000.0 else None


def _parse_number(cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def _check_wavelengths(path: str | Path, wavelengths_nm: Floats) -> None:
    """Raise DermisError unless the wavelengths cover 400 to 700 nm in steps of at most 20 nm."""
    expected = "wavelengths from 400 to 700 nm, at most 20 nm apart, as headings or in the first column"
    if len(wavelengths_nm) < _MIN_BAND_COUNT:
        refuse(path, expected, f"it has {len(wavelengths_nm)}", "Write headings such as 400 or r400")
    inside = wavelengths_nm[
        (wavelengths_nm > WAVELENGTHS_NM[0] - _MAX_WAVELENGTH_STEP_NM)
        & (wavelengths_nm < WAVELENGTHS_NM[-1] + _MAX_WAVELENGTH_STEP_NM)
    ]
    covered = (
        len(inside) > 1 and inside[0] <= 400.0 + _MAX_END_GAP_NM and inside[-1] >= 700.0 - _MAX_END_GAP_NM
    )
    if (
        not covered
        or np.diff(inside).max() > _MAX_WAVELENGTH_STEP_NM
        or (np.diff(wavelengths_nm) <= 0.0).any()
    ):
        refuse(
            path,
            expected,
            f"got {wavelengths_nm[0]:g} to {wavelengths_nm[-1]:g} nm",
            "Give the missing ones once each",
        )


@dataclass(frozen=True, eq=False)
class UnmixedSpectra:
    """Pigments estimated from a table of spectra.

    labels : for each spectrum, a dictionary from heading to text, for all cells that are not reflectances
    names : names of the parameters that were estimated
    fit : parameters fitted to the spectra that have no missing values
    complete : for each fitted spectrum, its index in the table
    """

    labels: list[dict[str, str]]
    names: tuple[str, ...]
    fit: SpectralFit
    complete: list[int]

    def rows(self) -> list[dict[str, Any]]:
        """Return a dictionary per spectrum: number, labels, parameters, and the errors of the fit.

        The errors are the RMS residual, the CIEDE2000 difference and the residual at each wavelength. For
        spectra with missing values, there are only number and labels.
        """
        rows: list[dict[str, Any]] = [
            {"row": number, "labels": labels} for number, labels in enumerate(self.labels, 1)
        ]
        rms, delta_e, residual = self.fit.rms_residual, self.fit.delta_e(), self.fit.residual
        for k, index in enumerate(self.complete):
            rows[index] |= {name: float(self.fit.values[name][k]) for name in self.names}
            rows[index] |= {"rms": float(rms[k]), "delta_e": float(delta_e[k])}
            rows[index]["residual"] = [round(float(one), 5) for one in residual[k]]
        return rows

    def summary(self) -> dict[str, Any]:
        """Return the number of spectra, and percentiles of the parameters and errors of all spectra."""
        values = self.fit.values | {"rms": self.fit.rms_residual, "delta_e": self.fit.delta_e()}
        percentiles = {}
        for name in (*self.names, "rms", "delta_e"):
            low, middle, high = (float(one) for one in np.percentile(values[name], (5.0, 50.0, 95.0)))
            percentiles[name] = {"p5": low, "median": middle, "p95": high}
        missing = len(self.labels) - len(self.complete)
        return {"spectra": len(self.complete), "missing": missing, **percentiles}


def unmix_spectra(
    path: str | Path,
    extra_unknowns: str = "none",
    skin: SkinParameters = DEFAULT_SKIN,
    surface: float = SPECULAR_INCLUDED_REFLECTANCE,
) -> UnmixedSpectra:
    """Estimate the pigments of each reflectance spectrum of a table.

    path : file with the table, see `read_spectra`
    extra_unknowns : parameters to estimate besides melanin and blood: "none", "oxygen", or "all" for oxygen,
        scattering and epidermal thickness
    skin : values of all other parameters
    surface : surface reflection that is subtracted from the spectra; 0 if they do not include it [-]

    Raises DermisError when `read_spectra` does, and for other `extra_unknowns` or a `surface` out of
    range.
    """
    if extra_unknowns not in UNKNOWN_NAMES_BY_SET:
        refuse("--find", ", ".join(UNKNOWN_NAMES_BY_SET), f"got {extra_unknowns!r}", "Choose one of them")
    surface = checked_number("--surface", surface, 0.0, 0.2, "a reflectance")
    table = read_spectra(path)
    complete = np.flatnonzero(np.isfinite(table.reflectance).all(axis=1))
    if len(complete) < len(table.labels):
        incomplete = len(table.labels) - len(complete)
        notify(f"{path}: {incomplete} of {len(table.labels)} spectra have missing values and no result")
    if not len(complete):
        refuse(path, "a complete spectrum", "all have missing values", "Fill the missing cells")
    names: Sequence[str] = UNKNOWN_NAMES_BY_SET[extra_unknowns]
    spectra = table.reflectance[complete] - surface
    parts = [fit_skin(part, names, "spectrum", skin) for part in _spectra_batches(spectra)]
    values = {name: np.concatenate([part.values[name] for part in parts]) for name in names}
    fit = SpectralFit(values, spectra, np.concatenate([part.model for part in parts]))
    return UnmixedSpectra(table.labels, tuple(names), fit, complete.tolist())


def _spectra_batches(spectra: Floats) -> list[Floats]:
    """Return the spectra in batches, each small enough to be fitted with little memory."""
    return np.array_split(spectra, -(-len(spectra) // _SPECTRA_PER_BATCH))
