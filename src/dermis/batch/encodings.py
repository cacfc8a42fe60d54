"""Outputs of a frame as files: levels of a PNG, an OpenEXR picture or an array of NumPy's."""

from __future__ import annotations

import io
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.frame.outputs import OUTPUTS
from dermis.images.codecs import decode_with_pillow, encode_png
from dermis.images.exr import decode_exr, encode_exr
from dermis.images.png_rows import decode_rows
from dermis.images.sizes import check_size

Array = NDArray[Any]
Encoding = Literal["png", "exr", "npy"]
EFFORT = 1
"""Of PNG's compression: 2 takes a tenth longer for 2 % fewer bytes."""


class Levels(NamedTuple):
    """Numbers as levels of a 16-bit PNG: value = (level - zero) * step, rounded and clipped."""

    step: float
    zero: int = 0


_SIGNED, _SHARE = Levels(1 / 32767, 32767), Levels(1 / 65535)
LEVELS = {
    "depth": Levels(0.1),
    "thickness": Levels(0.01),
    **dict.fromkeys(("normal", "normal_geometric", "normal_camera"), _SIGNED),
    **dict.fromkeys(("alpha", "barycentric", "albedo", "melanin", "blood"), _SHARE),
}
"""Outputs that fit into 16 bits: depth up to 6553.5 mm in steps of 0.1, directions to 0.002 degrees."""
_HALVES = frozenset(("irradiance", "diffuse", "specular", "translucent", "visibility"))
_MOST_LEVEL = 65535
_NPY = b"\x93NUMPY\x01\x00"


def file_kind(name: str, encoding: Encoding) -> str:
    """The kind of file that holds an output: png, exr or npy.

    encoding : png where its numbers fit into one, else as exr
    """
    output = OUTPUTS[name]
    if encoding == "npy" or not output.channels:
        return "npy"
    fits = name in LEVELS or np.dtype(output.kind) == np.uint8
    return "png" if fits and encoding == "png" else "exr"


def stored_as(name: str, encoding: Encoding) -> str:
    """How the numbers of an output are stored, in words."""
    kind = file_kind(name, encoding)
    if kind == "png" and name in LEVELS:
        step, zero = LEVELS[name]
        size = f"{step:g}" if step >= 1e-3 else f"1/{1 / step:.0f}"
        return f"16-bit PNG, value = {f'(level - {zero})' if zero else 'level'} x {size}"
    if kind == "png":
        return "8-bit PNG"
    bits = 16 if _is_half(name, encoding) else 32
    return f"OpenEXR, {bits}-bit floats" if kind == "exr" else f"NumPy, {_stored_kind(name, encoding)}"


def encode_output(name: str, values: Array, encoding: Encoding) -> bytes:
    """The file of an output, (h, w) or (h, w, c), of the kind that `file_kind` says."""
    picture = values[..., None] if values.ndim == 2 else values
    kind = file_kind(name, encoding)
    if kind == "npy":
        file = io.BytesIO()
        np.save(file, np.ascontiguousarray(values, _stored_kind(name, encoding)), allow_pickle=False)
        return file.getvalue()
    if kind == "exr":
        padded = np.pad(picture, ((0, 0), (0, 0), (0, 1))) if picture.shape[2] == 2 else picture
        return encode_exr(padded.astype(_exr_kind(name, encoding)))
    return encode_png(_levels(name, picture), EFFORT, runs=True)


def decode_output(name: str, kind: str, data: bytes) -> Array:
    """The values of an output, (h, w) or (h, w, c), from the bytes of its file.

    kind : png, exr or npy
    ValueError and others : the data are damaged, too large, or another kind of picture
    """
    if kind == "npy":
        return _decode_npy(data)
    picture = decode_exr(data) if kind == "exr" else decode_png(data)
    if name in LEVELS and kind == "png":
        step, zero = LEVELS[name]
        picture = (picture.astype(np.float32) - np.float32(zero)) * np.float32(step)
    channels = OUTPUTS[name].channels if name in OUTPUTS else 0
    if channels:
        if picture.shape[2] < channels:
            raise ValueError(f"it has {picture.shape[2]} channels, not {channels}")
        picture = picture[..., :channels].astype(OUTPUTS[name].kind)
    return picture[..., 0] if picture.shape[2] == 1 else picture


def decode_png(data: bytes) -> Array:
    """(h, w, c) of a PNG file."""
    picture = decode_rows(data)
    return decode_with_pillow(data) if picture is None else picture


def _levels(name: str, picture: Array) -> Array:
    if name not in LEVELS:
        return picture
    step, zero = LEVELS[name]
    scaled = np.nan_to_num(picture, nan=0.0) * np.float32(1 / step) + np.float32(zero)
    return np.rint(np.clip(scaled, 0, _MOST_LEVEL)).astype(np.uint16)


def _is_half(name: str, encoding: Encoding) -> bool:
    return encoding == "png" and name in _HALVES


def _exr_kind(name: str, encoding: Encoding) -> type[np.floating[Any]]:
    return np.float16 if _is_half(name, encoding) else np.float32


def _stored_kind(name: str, encoding: Encoding) -> np.dtype[Any]:
    """Of an array of NumPy's, little-endian on every machine."""
    kind = np.float16 if _is_half(name, encoding) else OUTPUTS[name].kind
    return np.dtype(kind).newbyteorder("<")


def _decode_npy(data: bytes) -> Array:
    """The array of a file of NumPy's, whose header is judged before there is room for it."""
    if not data.startswith(_NPY):
        raise ValueError("its first bytes are not those of an array of NumPy's")
    file = io.BytesIO(data[len(_NPY) :])
    shape, fortran, kind = np.lib.format.read_array_header_1_0(file)
    if len(shape) not in (2, 3) or fortran or kind.kind not in "fiu" or min(shape) < 1:
        raise ValueError(f"it holds {kind} of shape {shape}, which is no picture")
    check_size(shape[1], shape[0])
    stored = np.frombuffer(file.read(), kind)
    if stored.size != np.prod(shape, dtype=object):
        raise ValueError("its numbers are cut off, or more than it says")
    values = stored.reshape(shape)
    return values.astype(np.float32) if kind == np.float16 else values
