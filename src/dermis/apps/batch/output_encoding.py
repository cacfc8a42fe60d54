"""Outputs of a frame as files: levels of a PNG, an OpenEXR picture or an array of NumPy's."""

from __future__ import annotations

import io
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.output_files import png_levels
from dermis.images.codecs import decode_rows, decode_with_pillow, encode_png
from dermis.images.hdr import decode_exr, encode_exr
from dermis.images.sizes import check_size
from dermis.scene.outputs import OUTPUTS, Output

Array = NDArray[Any]
Encoding = Literal["png", "exr", "npy"]
_NPY = b"\x93NUMPY\x01\x00"
_MAX_HALF = 65504.0


def file_format(name: str, encoding: Encoding) -> str:
    """The kind of file that holds an output: png, exr or npy.

    encoding : png where its numbers fit into one, else as exr
    """
    output = OUTPUTS[name]
    if encoding == "npy" or not output.channels:
        return "npy"
    fits = output.levels is not None or output.kind == "uint8"
    return "png" if fits and encoding == "png" else "exr"


def storage_description(name: str, encoding: Encoding) -> str:
    """How the numbers of an output are stored, in words."""
    output, kind = OUTPUTS[name], file_format(name, encoding)
    if kind == "png" and output.levels is not None:
        step, zero = output.levels
        size = f"{step:g}" if step >= 1e-3 else f"1/{1 / step:.0f}"
        return f"16-bit PNG, {f'(level - {zero})' if zero else 'level'} x {size}"
    if kind == "png":
        return "8-bit PNG"
    bits = 8 * _stored_dtype(output, encoding).itemsize
    return f"OpenEXR, {bits}-bit floats" if kind == "exr" else f"NumPy, {_stored_dtype(output, encoding).name}"


def encode_output(name: str, values: Array, encoding: Encoding) -> bytes:
    """The file of an output, (h, w) or (h, w, c), of the kind that `file_format` says.

    Raises DermisError for numbers that are not finite.
    """
    if not np.isfinite(values).all():
        refuse(f"output {name}", "finite numbers", "others came", "Report this with the spec, please")
    output, kind = OUTPUTS[name], file_format(name, encoding)
    if kind == "npy":
        file = io.BytesIO()
        stored = _stored_dtype(output, encoding)
        limited = np.clip(values, -_MAX_HALF, _MAX_HALF) if stored.itemsize == 2 else values
        np.save(file, np.ascontiguousarray(limited, stored), allow_pickle=False)
        return file.getvalue()
    if kind == "png":
        return encode_png(np.atleast_3d(png_levels(name, values)), quick=True)
    picture = np.atleast_3d(values)
    padded = np.pad(picture, ((0, 0), (0, 0), (0, 1))) if picture.shape[2] == 2 else picture
    if _stored_dtype(output, encoding).itemsize > 2:
        return encode_exr(padded.astype(np.float32))
    return encode_exr(np.clip(padded, -_MAX_HALF, _MAX_HALF).astype(np.float16))


def decode_output(name: str, kind: str, data: bytes) -> Array:
    """The values of an output, (h, w) or (h, w, c), from the bytes of its file.

    kind : png, exr or npy
    ValueError and others : the data are damaged, too large, or another kind of picture
    """
    picture = _decode_npy(data) if kind == "npy" else decode_exr(data) if kind == "exr" else decode_png(data)
    if not np.isfinite(picture).all():
        raise ValueError("it has numbers that are not finite")
    if name not in OUTPUTS:
        return picture[..., 0] if picture.shape[2] == 1 else picture
    output = OUTPUTS[name]
    if picture.shape[2] < output.channels:
        raise ValueError(f"it has {picture.shape[2]} channels, not {output.channels}")
    picture = picture[..., : output.channels or None]
    if kind == "png" and output.levels is not None:
        step, zero = output.levels
        picture = (picture.astype(np.float32) - np.float32(zero)) * np.float32(step)
    if np.dtype(output.kind).kind in "iu" and picture.size:
        ends = np.iinfo(output.kind)
        if picture.min() < ends.min or picture.max() > ends.max:
            raise ValueError(f"its numbers are beyond {ends.min} to {ends.max}")
    values = picture.astype(output.kind)
    return values[..., 0] if output.channels == 1 else values


def decode_png(data: bytes) -> Array:
    """(h, w, c) of a PNG file."""
    picture = decode_rows(data)
    return decode_with_pillow(data) if picture is None else picture


def _stored_dtype(output: Output, encoding: Encoding) -> np.dtype[Any]:
    """Of its numbers in a file, little-endian on every machine."""
    half = encoding == "png" and output.kind == "float32" and output.levels is None
    return np.dtype(np.float16 if half else output.kind).newbyteorder("<")


def _decode_npy(data: bytes) -> Array:
    """The array of a file of NumPy's, whose header is judged before there is room for it."""
    if not data.startswith(_NPY):
        raise ValueError("its first bytes are not those of an array of NumPy's")
    file = io.BytesIO(data[len(_NPY) :])
    shape, fortran, kind = np.lib.format.read_array_header_1_0(file)
    if len(shape) not in (2, 3) or fortran or kind.kind not in "fiu":
        raise ValueError(f"it holds {kind} of shape {shape}, which is no picture")
    check_size(shape[1], shape[0])  # of no lights there are no channels
    stored = np.frombuffer(file.read(), kind)
    if stored.size != np.prod(shape, dtype=object):
        raise ValueError("its numbers are cut off, or more than it says")
    values = np.atleast_3d(stored.reshape(shape))
    return values.astype(np.float32) if kind == np.float16 else values
