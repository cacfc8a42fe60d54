"""Tables of measured reflectance spectra, and spectra of lamps and cameras."""

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


def _lamp(rng: Random) -> Input:
    """Return the power of a lamp, and the sensitivities of a camera."""
    random = np.random.default_rng(rng.getrandbits(32)).uniform(0.1, 1.0, (33, 4))
    rows = [(nm, *row) for nm, row in zip(range(390, 720, 10), random.tolist(), strict=True)]
    lamp, camera = (
        "nm,value\n" + "".join(",".join(f"{one:g}" for one in row[:count]) + "\n" for row in rows)
        for count in (2, 5)
    )
    camera = "\n".join(",".join(line.split(",")[:4]) for line in camera.splitlines()[1:])
    files = {"lamp.csv": lamp.encode(), "camera.csv": camera.encode()}
    return Input(files, {"file": "lamp.csv", "camera": "camera.csv"})


def _light(plan: Plan) -> None:
    """Compute the colours of a spectrum under the lamp, for an eye and for the camera."""
    from dermis.optics.lamps import band_power, read_sensitivities, sensor_weights, xyz_weights

    power = band_power(plan["file"], WAVELENGTHS_NM)
    grid, response = read_sensitivities(plan["camera"], plan["file"])
    signals = sensor_weights(plan["file"], grid, response, WAVELENGTHS_NM)
    for values in (power, signals, xyz_weights(plan["file"], WAVELENGTHS_NM)):
        if not np.isfinite(values).all():
            raise FoundError(WRONG, "a result is not finite")


KINDS = (Kind("spectra", _table, _take), Kind("lamps", _lamp, _light))
