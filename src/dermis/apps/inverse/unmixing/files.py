"""Maps of an unmixed skin in a folder."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.unmixing.unmix import Unmixed
from dermis.base.atomic_write import replacing
from dermis.images.hdr import encode_exr
from dermis.images.io import write_image

SUMMARY = "unmixed.json"


def save(
    folder: Path, found: Unmixed, recoloured: NDArray[np.float32] | None = None, linear: bool = False
) -> list[Path]:
    """Write each map as EXR, the table, and the other colours if any; each file whole or not at all.

    linear : whether the other colours are written as EXR rather than PNG

    Raises DermisError when the disk is full, or the folder cannot be written to.
    """
    written = []
    for name, values in found.maps().items():
        path = folder / f"{name}.exr"
        with replacing(path) as trial:
            trial.write_bytes(encode_exr(values if values.ndim == 3 else values[..., None]))
        written.append(path)
    if recoloured is not None:
        path = folder / ("recoloured.exr" if linear else "recoloured.png")
        write_image(path, recoloured)
        written.append(path)
    with replacing(folder / SUMMARY) as trial:
        trial.write_text(json.dumps(found.summary(), indent=2) + "\n", encoding="utf-8")
    return [*written, folder / SUMMARY]
