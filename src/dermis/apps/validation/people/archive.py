"""Reflectance spectra of the International Skin Spectra Archive, read from a CSV file."""

from __future__ import annotations

import csv
import gzip
from functools import cache
from io import StringIO
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.validation.pages import data_file
from dermis.base.arrays import Doubles
from dermis.base.reading import MAX_TEXT_BYTES, read_file
from dermis.human.skin.measured import GROUPS, SITES
from dermis.images.colour import lab
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights

ARCHIVE_FILE = "reference/measured/issa_skin_spectra.csv.gz"
"""Path of the archive in the folder DERMIS_DATA."""
SURFACE_REFLECTANCE: Final = 0.0278
"""Specular reflectance of skin that is subtracted, at normal incidence for an index of 1.4 [-]."""
AGE_MIDDLES: Final = {1: 17.0, 2: 25.0, 3: 35.0, 4: 45.0, 5: 55.0, 6: 65.0}
"""Age in the middle of each age group of the archive [years]."""
_SEXES = {"F": 0.0, "M": 1.0}
_NO_VALUE = float("nan")


class Archive(NamedTuple):
    """Spectra of n measurements of living skin, without the specular component.

    group, site : (n,) indices into `GROUPS` and `SITES`
    person : (n,) index of the person
    sex : (n,) 0 for female, 1 for male, NaN where unknown
    age : (n,) age in the middle of the person's age group, NaN where unknown [years]
    reflectance : (n, 31) at `WAVELENGTHS_NM`, without surface reflection [-]

    Source: [Lu2025].
    """

    group: NDArray[np.int64]
    site: NDArray[np.int64]
    person: NDArray[np.int64]
    sex: Doubles
    age: Doubles
    reflectance: Doubles

    @property
    def cielab(self) -> Doubles:
        """Return the colours (n, 3) under D65, CIELAB."""
        return lab(self.reflectance @ rgb_weights(WAVELENGTHS_NM).T)

    def rows(self, selected: NDArray[np.bool_]) -> Archive:
        """Return the selected measurements."""
        columns: Any = (column[selected] for column in self)
        return Archive(*columns)


@cache
def load_archive(path: Path | None = None) -> Archive:
    """Return the measurements of the archive, from the folder DERMIS_DATA or a given file.

    Raises DermisError if there is no such file.
    """
    return parse_archive(_read_text(path or data_file(ARCHIVE_FILE)))


def parse_archive(text: str) -> Archive:
    """Return the measurements of a CSV text with the columns of the archive."""
    rows = list(csv.DictReader(line for line in StringIO(text) if not line.startswith("#")))
    people: dict[str, int] = {}
    person = [people.setdefault(f"{row['origin']} {row['subject']}", len(people)) for row in rows]
    spectra = np.array([[float(row[f"r{nm:g}"]) for nm in WAVELENGTHS_NM] for row in rows])
    return Archive(
        group=np.array([list(GROUPS).index(row["group"]) for row in rows]),
        site=np.array([int(row["site"]) - 1 for row in rows]),
        person=np.array(person),
        sex=np.array([_SEXES.get(row["sex"].strip(), _NO_VALUE) for row in rows]),
        age=np.array(
            [AGE_MIDDLES[int(float(row["age_group"]))] if row["age_group"] else _NO_VALUE for row in rows]
        ),
        reflectance=spectra.reshape(-1, len(WAVELENGTHS_NM)) - SURFACE_REFLECTANCE,
    )


def _read_text(path: Path) -> str:
    data = read_file(path, "a table of spectra", MAX_TEXT_BYTES)
    return (gzip.decompress(data) if path.suffix == ".gz" else data).decode("utf-8")


assert len(SITES) == 12
