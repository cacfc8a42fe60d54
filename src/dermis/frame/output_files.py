"""Writing of outputs as OpenEXR, PNG and NumPy files."""

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
_PNG_MAX = 65535
_PICTURE_PART = "rgba"  # name of the first part, a convention of compositing programs


def check_formats(names: Iterable[str], kind: Format) -> None:
    """Raise DermisError for an output that a file format cannot store.

    names : names of outputs
    kind : file format
    """
    for name in names:
        if kind == "png" and OUTPUTS[name].quantisation is None and OUTPUTS[name].kind != "uint8":
            refuse(f"output {name}", "exr or npy", "got png, which cannot hold it", "Choose one of these")


def output_path(path: Path, name: str, kind: Format) -> Path:
    """Return the path of an output's file beside a picture, such as face.depth.exr beside face.png."""
    return path.with_name(f"{path.stem}.{name}.{kind}")


def encode_output(name: str, values: PlaneArray, kind: Format) -> bytes:
    """Return the bytes of a file with one output; equal arrays give equal bytes.

    name : name of the output
    values : (h, w) or (h, w, c) array of the output
    kind : file format
    """
    return _ENCODERS[kind](name, values)


def write_output(path: Path, name: str, values: PlaneArray) -> None:
    """Write an output as .exr, .png or .npy, atomically.

    name : name of the output
    values : (h, w) or (h, w, c) array of the output
    """
    kinds: dict[str, Format] = {".exr": "exr", ".png": "png", ".npy": "npy"}
    _write_atomically(path, encode_output(name, values, kinds[path.suffix.lower()]))


def write_multipart(path: Path, picture: PlaneArray, values: Mapping[str, PlaneArray]) -> None:
    """Write a linear picture and outputs as the parts of one OpenEXR file.

    picture : (h, w, 3 or 4) linear floats
    values : arrays of the outputs by name
    """
    parts = {_PICTURE_PART: dict(zip("RGBA", np.moveaxis(picture, -1, 0), strict=False))}
    parts |= {name: _channels(OUTPUTS[name], one) for name, one in values.items()}
    _write_atomically(path, encode_exr_parts(parts))


def quantise(name: str, values: PlaneArray) -> NDArray[np.uint8 | np.uint16]:
    """Return an output as integers for a PNG file, (h, w) or (h, w, 3).

    Outputs with two channels get a third channel of zeros, because PNG has no format with two colour
    channels.
    """
    if values.dtype == np.uint8:
        return values
    quantisation = OUTPUTS[name].quantisation
    assert quantisation is not None, "check_formats accepts only quantised outputs"
    words = np.clip(np.rint(values / quantisation.step + quantisation.zero), 0, _PNG_MAX).astype(np.uint16)
    return words if words.ndim == 2 or words.shape[2] > 2 else np.pad(words, ((0, 0), (0, 0), (0, 1)))


def _channels(output: Output, values: PlaneArray) -> dict[str, PlaneArray]:
    """Return the channels of an output by their names in an OpenEXR file: depth.Z, normal.X, ..."""
    channels = np.atleast_3d(values)
    names = output.channel_names or [str(k) for k in range(channels.shape[2])]
    return {f"{output.name}.{name}": channels[..., k] for k, name in enumerate(names)}


def _as_exr(name: str, values: PlaneArray) -> bytes:
    return encode_exr_parts({name: _channels(OUTPUTS[name], values)}, run_length=True)


def _as_png(name: str, values: PlaneArray) -> bytes:
    words = quantise(name, values)
    return encode_png(words[..., None] if words.ndim == 2 else words, 6)


def _as_npy(name: str, values: PlaneArray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, values, allow_pickle=False)
    return stream.getvalue()


_ENCODERS: Mapping[Format, Callable[[str, PlaneArray], bytes]] = {
    "exr": _as_exr,
    "png": _as_png,
    "npy": _as_npy,
}


def _write_atomically(path: Path, data: bytes) -> None:
    with files.atomic_file(path) as temporary:
        temporary.write_bytes(data)
