"""Reflectance spectra of the International Skin Spectra Archive, each with its person, group and site."""

from __future__ import annotations

import csv
import gzip
from functools import cache
from typing import Any, Final, NamedTuple
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.unmixing.spectral_inversion import SPECULAR_INCLUDED_REFLECTANCE
from dermis.apps.validation.pages import data_file
from dermis.base.arrays import Doubles
from dermis.base.tables import float_columns
from dermis.images.colour import lab
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights

FOLD_COUNT = 5  # number of parts of the people for cross-validation
AGE_MIDDLES: Final = {1: 17.0, 2: 25.0, 3: 35.0, 4: 45.0, 5: 55.0, 6: 65.0}
"""Age in the middle of each age group of the archive [years]."""
_ARCHIVE_FILE = "reference/measured/issa_skin_spectra.csv.gz"
_SEX_BY_CODE = {"F": 0.0, "M": 1.0}
_MISSING_VALUE = float("nan")


class Archive(NamedTuple):
    """Spectra of n measurements of living skin.

    spectra : (n, 31) diffuse reflectance at `WAVELENGTHS_NM`, without surface reflection [-]
    person : (n,) index of the person
    fold : (n,) index of the cross-validation fold that contains the person, 0 to `FOLD_COUNT` - 1
    group : (n,) key of `dermis.human.skin.measured.GROUP_OF_CODE`
    site : (n,) index in `dermis.human.skin.measured.SITES`
    sex : (n,) 0 for female, 1 for male, NaN where unknown
    age : (n,) age in the middle of the person's age group, NaN where unknown [years]

    Source: [Lu2025].
    """

    spectra: Doubles
    person: NDArray[np.int64]
    fold: NDArray[np.int64]
    group: NDArray[np.str_]
    site: NDArray[np.int64]
    sex: Doubles
    age: Doubles

    @property
    def cielab(self) -> Doubles:
        """Return the CIELAB colours (n, 3) of the spectra under D65."""
        return lab(self.spectra @ rgb_weights(WAVELENGTHS_NM).T)

    def select_rows(self, row_selection: NDArray[np.bool_] | NDArray[np.int64]) -> Archive:
        """Return the measurements that a mask or indices select."""
        columns: Any = (column[row_selection] for column in self)
        return Archive(*columns)

    def sample_rows(self, row_count: int, seed: int = 0) -> Archive:
        """Return at most `row_count` measurements, chosen at random."""
        return self.select_rows(np.random.default_rng(seed).permutation(len(self.spectra))[:row_count])


@cache
def read_archive() -> Archive:
    """Read the archive from the folder DERMIS_DATA.

    Raises DermisError when the file is missing.
    """
    with gzip.open(data_file(_ARCHIVE_FILE), "rt", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    # Subjects are numbered separately for each origin. The hash spreads people over folds independently of
    # their order.
    names = [f"{row['origin']}/{row['subject']}" for row in rows]
    number = {name: index for index, name in enumerate(dict.fromkeys(names))}
    ages = (AGE_MIDDLES[int(float(row["age_group"]))] if row["age_group"] else _MISSING_VALUE for row in rows)
    return Archive(
        spectra=float_columns(rows, " ".join(f"r{nm:.0f}" for nm in WAVELENGTHS_NM))
        - SPECULAR_INCLUDED_REFLECTANCE,
        person=np.array([number[name] for name in names]),
        fold=np.array([crc32(name.encode()) % FOLD_COUNT for name in names]),
        group=np.array([row["group"] for row in rows]),
        site=np.array([int(row["site"]) - 1 for row in rows]),
        sex=np.array([_SEX_BY_CODE.get(row["sex"].strip(), _MISSING_VALUE) for row in rows]),
        age=np.array(list(ages)),
    )
