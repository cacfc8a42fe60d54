"""Spectral pictures in OpenEXR files, with one channel for each wavelength."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dermis.base.arrays import Doubles, Floats
from dermis.base.atomic_write import atomic_file

_LAYOUT_VERSION = "1.0"


def spectral_channel(wavelength_nm: float) -> str:
    """Return the name of the channel of a wavelength, such as S0.550,000000nm [Fichet2021]."""
    return f"S0.{wavelength_nm:.6f}nm".replace(".", ",").replace("S0,", "S0.")


def write_spectral_exr(
    path: str | Path,
    wavelengths_nm: Doubles,
    radiance: Floats,
    preview: Floats | None = None,
    alpha: Floats | None = None,
    attributes: Mapping[str, str] | None = None,
) -> None:
    """Write the spectra of a picture to an OpenEXR file of 32-bit floats in the layout of [Fichet2021].

    wavelengths_nm : (n,) wavelengths [nm]
    radiance : (h, w, n) radiance at the wavelengths
    preview : (h, w, 3) linear Rec. 709, stored as channels R, G and B, which other programs show
    alpha : (h, w) coverage, stored as channel A
    attributes : further entries of the header

    Source: [Fichet2021].
    """
    import OpenEXR

    channels = {spectral_channel(one): radiance[..., k] for k, one in enumerate(wavelengths_nm.tolist())}
    if preview is not None:
        channels |= {name: preview[..., k] for k, name in enumerate("RGB")}
    if alpha is not None:
        channels["A"] = alpha
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    header |= {"spectralLayoutVersion": _LAYOUT_VERSION, "emissiveUnits": "relative", **(attributes or {})}
    floats = {name: np.ascontiguousarray(values, np.float32) for name, values in channels.items()}
    encoded = io.BytesIO()
    OpenEXR.File(header, floats).write(encoded)
    with atomic_file(path) as temporary:
        temporary.write_bytes(encoded.getvalue())
