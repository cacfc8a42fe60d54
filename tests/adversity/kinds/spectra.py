"""Tables of measured reflectance spectra."""

from __future__ import annotations

import gzip
from random import Random

import numpy as np
from adversity.case import WRONG, FoundError, Input, Plan
from adversity.kind import Kind

from dermis.optics.pigments.spectra import WAVELENGTHS_NM

_ROWS = 3


def _table(rng: Random) -> Input:
    spectra = np.random.default_rng(rng.getrandbits(32)).uniform(0.1, 0.5, (_ROWS, len(WAVELENGTHS_NM)))
    separator = rng.choice(",;\t")
    table = [["site", *(f"r{nm:.0f}" for nm in WAVELENGTHS_NM)]]
    table += [["cheek", *(f"{one:.4f}" for one in row)] for row in spectra]
    if rng.random() < 0.5:
        table = [list(column) for column in zip(*table, strict=True)]
    text = "# measured\n" + "\n".join(separator.join(row) for row in table) + "\n"
    if rng.random() < 0.3:
        return Input({"spectra.csv.gz": gzip.compress(text.encode())}, {"file": "spectra.csv.gz"})
    return Input({"spectra.csv": text.encode()}, {"file": "spectra.csv"})


def _take(plan: Plan) -> None:
    """Find the pigments of all spectra."""
    from dermis.apps.inverse.unmixing.spectra_file import unmix_spectra

    found = unmix_spectra(plan["file"], "oxygen")
    for values in (*found.fit.values.values(), found.fit.rms_residual):
        if not np.isfinite(values).all():
            raise FoundError(WRONG, "a result is not finite")


KINDS = (Kind("spectra", _table, _take),)
