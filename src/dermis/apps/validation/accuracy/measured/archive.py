"""Reflectance spectra of the International Skin Spectra Archive, with folds of people, and illuminants."""

from __future__ import annotations

import csv
import gzip
from dataclasses import dataclass
from functools import cache
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.unmixing.spectral_inversion import SPECULAR_INCLUDED
from dermis.apps.validation.pages import data_file
from dermis.base.tables import float_columns, read_rows
from dermis.images.colour import linear_of_xyz
from dermis.optics.media import Floats
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, interpolate_spectrum, rgb_weights

ARCHIVE_FILE = "reference/measured/issa_skin_spectra.csv.gz"
FOLDS = 5  # number of parts of the people for cross-validation
GROUPS = {
    "CA": "Caucasian",
    "CN": "Chinese",
    "JP": "Japanese",
    "TH": "Thai",
    "SA": "South Asian",
    "IQ": "Middle Eastern (Iraq)",
    "AB": "Middle Eastern (Arabia)",
    "AF": "African",
}
SITES = (
    "back of hand",
    "cheek",
    "cheekbone",
    "chin",
    "ear lobe",
    "forehead",
    "inner arm",
    "neck",
    "nose tip",
    "outer arm",
    "palm",
    "ring finger",
)
"""Names of the archive's sites, whose codes are 1 to 12."""
CHEEK_AND_FOREHEAD = (1, 5)
"""Indices of the two facial sites that most people have."""
ILLUMINANTS = {"D65": "", "A": "a", "FL11": "fl11", "LED-B3": "led_b3"}


@dataclass(frozen=True, eq=False)
class Archive:
    """Spectra of n measurements, with the person, group and site of each.

    spectra : (n, 31) diffuse reflectance at `WAVELENGTHS_NM`, without the surface's reflection [-]
    person : (n,) number that identifies the person
    fold : (n,) index of the cross-validation fold that contains the person, 0 to `FOLDS` - 1
    group : (n,) key of `GROUPS`
    site : (n,) index in `SITES`

    Source: [Lu2025].
    """

    spectra: Floats
    person: NDArray[np.int64]
    fold: NDArray[np.int64]
    group: NDArray[np.str_]
    site: NDArray[np.int64]

    def __len__(self) -> int:
        """Return the number of measurements."""
        return len(self.spectra)

    def where(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> Archive:
        """Return selected measurements, by a mask or by indices."""
        rows = np.arange(len(self))[chosen]
        return Archive(
            self.spectra[rows], self.person[rows], self.fold[rows], self.group[rows], self.site[rows]
        )

    def sample(self, count: int, seed: int = 0) -> Archive:
        """Return at most `count` measurements, chosen at random."""
        return self.where(np.random.default_rng(seed).permutation(len(self))[:count])


def read_archive() -> Archive:
    """Read the archive from the folder DERMIS_DATA.

    Raises DermisError when the file is missing.
    """
    with gzip.open(data_file(ARCHIVE_FILE), "rt", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    spectra = float_columns(rows, " ".join(f"r{nm:.0f}" for nm in WAVELENGTHS_NM)) - SPECULAR_INCLUDED
    # Subjects are numbered separately for each origin. The hash spreads people over folds independently of
    # their order.
    person = np.array([crc32(f"{row['origin']}/{row['subject']}".encode()) for row in rows])
    group = np.array([row["group"] for row in rows])
    return Archive(spectra, person, person % FOLDS, group, np.array([int(row["site"]) - 1 for row in rows]))


@cache
def colour_weights(illuminant: str) -> Floats:
    """Return weights (3, 31) from spectra to linear Rec. 709 colours with the L*a*b* under an illuminant.

    illuminant : key of `ILLUMINANTS`

    Source: [CIE2004] for the observer and for the formulae of L*a*b*.
    """
    if illuminant == "D65":
        return rgb_weights()
    rows = read_rows(__package__ or "", "illuminants")
    fine, light = float_columns(rows, f"wavelength_nm {ILLUMINANTS[illuminant]}").T
    observer = np.array([interpolate_spectrum("cie-1931-d65", f"{axis}_bar", fine) for axis in "xyz"])
    hats = np.array([np.interp(fine, WAVELENGTHS_NM, unit) for unit in np.eye(len(WAVELENGTHS_NM))])
    xyz = (observer * light) @ hats.T
    return linear_of_xyz((xyz / xyz.sum(axis=1, keepdims=True)).T).T
