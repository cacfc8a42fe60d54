"""Encoding of output arrays as PNG, OpenEXR and NumPy files, and their decoding."""

from __future__ import annotations

import io
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.clips.flow import FLOW_OUTPUTS
from dermis.base.errors import refuse
from dermis.frame.output_files import quantise_levels
from dermis.images.codecs import decode_up_filtered_png, decode_with_pillow, encode_png
from dermis.images.hdr import decode_exr, encode_exr
from dermis.images.sizes import check_size
from dermis.scene.outputs import OUTPUTS, Output

Array = NDArray[Any]
Encoding = Literal["png", "exr", "npy"]
LINEAR_PICTURE = "linear"
"""Name of the linear picture before the model of the sensor, as an output of an image."""
_NPY_MAGIC = b"\x93NUMPY\x01\x00"
_MAX_HALF_FLOAT = 65504.0


def stored_output(output_name: str) -> Output:
    """Return the description of an output of an image: one of a frame, or the flow of clips."""
    return FLOW_OUTPUTS.get(output_name) or OUTPUTS[output_name]


def file_format(output_name: str, encoding: Encoding) -> str:
    """Return the file format in which an output is stored: png, exr or npy.

    encoding : requested format; if it is png, outputs that 16-bit integers cannot hold are stored as exr
    """
    output = stored_output(output_name)
    if encoding == "npy" or not output.channels:
        return "npy"
    fits = output.quantisation is not None or output.kind == "uint8"
    return "png" if fits and encoding == "png" else "exr"


def storage_description(output_name: str, encoding: Encoding) -> str:
    """Return a text that says how an output is stored, such as "16-bit PNG, level x 1/64".

    In this example, a value of the output is 1/64 of the stored integer ("level").
    """
    output, kind = stored_output(output_name), file_format(output_name, encoding)
    if kind == "png" and output.quantisation is not None:
        step, zero = output.quantisation
        size = f"{step:g}" if step >= 1e-3 else f"1/{1 / step:.0f}"
        return f"16-bit PNG, {f'(level - {zero})' if zero else 'level'} x {size}"
    if kind == "png":
        return "8-bit PNG"
    dtype = _stored_dtype(output, encoding)
    return f"OpenEXR, {8 * dtype.itemsize}-bit floats" if kind == "exr" else f"NumPy, {dtype.name}"


def encode_output(output_name: str, output_array: Array, encoding: Encoding) -> bytes:
    """Return an output array (h, w) or (h, w, c) as the bytes of a file in the format from `file_format`.

    Raises DermisError for numbers that are not finite.
    """
    if not np.isfinite(output_array).all():
        refuse(f"output {output_name}", "finite numbers", "some are not", "Report this with the spec, please")
    kind, dtype = file_format(output_name, encoding), _stored_dtype(stored_output(output_name), encoding)
    if kind == "png":
        levels = quantise_levels(output_array, stored_output(output_name).quantisation)
        return encode_png(np.atleast_3d(levels), use_isal=True)
    limited = (
        np.clip(output_array, -_MAX_HALF_FLOAT, _MAX_HALF_FLOAT) if dtype.itemsize == 2 else output_array
    )
    if kind == "npy":
        file = io.BytesIO()
        np.save(file, np.ascontiguousarray(limited, dtype), allow_pickle=False)
        return file.getvalue()
    picture = np.atleast_3d(limited)
    padded = np.pad(picture, ((0, 0), (0, 0), (0, 1))) if picture.shape[2] == 2 else picture
    return encode_exr(padded.astype(np.float32 if dtype.itemsize > 2 else np.float16))


def encode_linear_picture(linear_picture: Array) -> bytes:
    """Return a linear picture (h, w, 3) as the bytes of an OpenEXR file of 16-bit floats."""
    return encode_exr(half_precision(linear_picture).astype(np.float16))


def half_precision(linear_picture: Array) -> NDArray[np.float32]:
    """Return a linear picture rounded to 16-bit floats, the precision of its file."""
    limited = np.clip(linear_picture, -_MAX_HALF_FLOAT, _MAX_HALF_FLOAT)
    return np.asarray(limited.astype(np.float16), np.float32)


def decode_output(output_name: str, format_name: str, file_bytes: bytes) -> Array:
    """Return an output array (h, w) or (h, w, c) from the bytes of a file.

    format_name : file format: png, exr or npy

    Raises ValueError and other exceptions for data that are damaged, too large, or of another format.
    """
    picture = (
        _decode_npy(file_bytes)
        if format_name == "npy"
        else decode_exr(file_bytes)
        if format_name == "exr"
        else decode_png(file_bytes)
    )
    if not np.isfinite(picture).all():
        raise ValueError("it has numbers that are not finite")
    if output_name not in OUTPUTS and output_name not in FLOW_OUTPUTS:
        return picture[..., 0] if picture.shape[2] == 1 else picture
    output = stored_output(output_name)
    if picture.shape[2] < output.channels:
        raise ValueError(f"it has {picture.shape[2]} channels, not {output.channels}")
    picture = picture[..., : output.channels or None]
    if format_name == "png" and output.quantisation is not None:
        step, zero = output.quantisation
        picture = (picture.astype(np.float32) - np.float32(zero)) * np.float32(step)
    if np.dtype(output.kind).kind in "iu" and picture.size:
        limits = np.iinfo(output.kind)
        if picture.min() < limits.min or picture.max() > limits.max:
            raise ValueError(f"its numbers are outside {limits.min} to {limits.max}")
    values = picture.astype(output.kind)
    return values[..., 0] if output.channels == 1 else values


def decode_png(png_bytes: bytes) -> Array:
    """Return the pixels (h, w, c) of a PNG file."""
    picture = decode_up_filtered_png(png_bytes)
    return decode_with_pillow(png_bytes) if picture is None else picture


def _stored_dtype(output: Output, encoding: Encoding) -> np.dtype[Any]:
    """Return the number type of an output in its file, little-endian on every machine."""
    half = encoding == "png" and output.kind == "float32" and output.quantisation is None
    return np.dtype(np.float16 if half else output.kind).newbyteorder("<")


def _decode_npy(npy_bytes: bytes) -> Array:
    """Return the array in a NumPy file; the array's shape is checked before memory is allocated."""
    if not npy_bytes.startswith(_NPY_MAGIC):
        raise ValueError("it is not a NumPy array file of version 1.0")
    file = io.BytesIO(npy_bytes[len(_NPY_MAGIC) :])
    shape, fortran_order, dtype = np.lib.format.read_array_header_1_0(file)
    if len(shape) not in (2, 3) or fortran_order or dtype.kind not in "fiu":
        raise ValueError(f"it contains {dtype} of shape {shape}, which is not a picture")
    check_size(shape[1], shape[0])  # the number of channels may be 0: one per light
    stored = np.frombuffer(file.read(), dtype)
    if stored.size != np.prod(shape, dtype=object):
        raise ValueError(f"it has {stored.size} numbers, not those of shape {shape}")
    values = np.atleast_3d(stored.reshape(shape))
    return values.astype(np.float32) if dtype == np.float16 else values
