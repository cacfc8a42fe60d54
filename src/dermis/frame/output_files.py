"""Outputs as files: OpenEXR, PNG and NumPy."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dermis.base import atomic_write as files
from dermis.base.errors import refuse
from dermis.frame.features.outputs.planes import PlaneArray
from dermis.images.codecs import encode_png
from dermis.images.io import encode_exr_parts
from dermis.scene.outputs import OUTPUTS, Output

Format = Literal["exr", "png", "npy"]
_MOST_LEVEL = 65535
_PICTURE = "rgba"  # of a file's first part, as compositing programs call it


def check_formats(names: Iterable[str], kind: Format) -> None:
    """Raises DermisError for an output that a format cannot hold."""
    for name in names:
        if kind == "png" and OUTPUTS[name].levels is None and OUTPUTS[name].kind != "uint8":
            refuse(f"output {name}", "exr or npy", "png came, which cannot hold it", "Choose one of these")


def beside(path: Path, name: str, kind: Format) -> Path:
    """Where an output is written beside a picture: face.depth.exr."""
    return path.with_name(f"{path.stem}.{name}.{kind}")


def encoded(name: str, values: PlaneArray, kind: Format) -> bytes:
    """An output as a file, the same to the byte each time.

    values : (h, w) or (h, w, c)
    """
    return _ENCODERS[kind](name, values)


def write_output(path: Path, name: str, values: PlaneArray) -> None:
    """Write an output as .exr, .png or .npy, whole or not at all; values as of `encoded`."""
    kinds: dict[str, Format] = {".exr": "exr", ".png": "png", ".npy": "npy"}
    _write(path, encoded(name, values, kinds[path.suffix.lower()]))


def write_together(path: Path, picture: PlaneArray, values: Mapping[str, PlaneArray]) -> None:
    """Write a linear picture and outputs as the parts of one OpenEXR file.

    picture : (h, w, 3 or 4)
    values : of the outputs by name
    """
    parts = {_PICTURE: dict(zip("RGBA", np.moveaxis(picture, -1, 0), strict=False))}
    parts |= {name: _channels(OUTPUTS[name], one) for name, one in values.items()}
    _write(path, encode_exr_parts(parts))


def png_levels(name: str, values: PlaneArray) -> NDArray[np.uint8 | np.uint16]:
    """(h, w) or (h, w, 3) of an output as a PNG holds it; of two channels the third is 0."""
    if values.dtype == np.uint8:
        return values
    levels = OUTPUTS[name].levels
    assert levels is not None, "checked before"
    found = np.clip(np.rint(values / levels.step + levels.zero), 0, _MOST_LEVEL).astype(np.uint16)
    return found if found.ndim == 2 or found.shape[2] > 2 else np.pad(found, ((0, 0), (0, 0), (0, 1)))


def _channels(output: Output, values: PlaneArray) -> dict[str, PlaneArray]:
    """By their names in a file: depth.Z, normal.X, ..."""
    each = np.atleast_3d(values)
    letters = output.letters or [str(k) for k in range(each.shape[2])]
    return {f"{output.name}.{letter}": each[..., k] for k, letter in enumerate(letters)}


def _as_exr(name: str, values: PlaneArray) -> bytes:
    return encode_exr_parts({name: _channels(OUTPUTS[name], values)}, swift=True)


def _as_png(name: str, values: PlaneArray) -> bytes:
    levels = png_levels(name, values)
    return encode_png(levels[..., None] if levels.ndim == 2 else levels, 6)


def _as_npy(name: str, values: PlaneArray) -> bytes:
    into = io.BytesIO()
    np.save(into, values, allow_pickle=False)
    return into.getvalue()


_ENCODERS: Mapping[Format, Callable[[str, PlaneArray], bytes]] = {
    "exr": _as_exr,
    "png": _as_png,
    "npy": _as_npy,
}


def _write(path: Path, data: bytes) -> None:
    with files.replacing(path) as temporary:
        temporary.write_bytes(data)
