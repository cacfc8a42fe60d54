"""Reading and writing of picture files: PNG, JPEG, TIFF, OpenEXR and Radiance."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.base import atomic_write as outputs
from dermis.base.arrays import Numbers
from dermis.base.errors import DermisError, refuse
from dermis.base.reading import read_file
from dermis.images.codecs import PILLOW_SIGNATURES, Pixels, decode_with_pillow, encode_png, pillow_size
from dermis.images.colour import encode_srgb8
from dermis.images.hdr import (
    EXR_SIGNATURE,
    RADIANCE_SIGNATURE,
    decode_exr,
    decode_radiance,
    exr_size,
    radiance_size,
)
from dermis.images.sizes import MAX_FILE_BYTES, TooLargeError

OUTPUT_SUFFIXES = (".png", ".exr")
T = TypeVar("T")
_READABLE = "a picture (PNG, JPEG, TIFF, EXR or HDR)"


@dataclass(frozen=True)
class EmbeddedPicture:
    """A picture file that lies inside another file.

    name : for messages
    data : its bytes, PNG, JPEG or TIFF
    """

    name: str
    data: bytes = field(repr=False)

    def __str__(self) -> str:
        return self.name


def read_image(path: str | Path | EmbeddedPicture) -> Pixels:
    """The picture (H, W, C) as it is stored, row 0 at the top; C is 1 (grey), 3 (RGB) or 4 (RGBA).

    path : PNG, JPEG or TIFF, which give uint8 or uint16 (a float TIFF float32), or EXR or HDR, which
        give linear float32; recognised by content, not by suffix
    DermisError : the file is missing, is no picture, is cut off, or holds pixels of another kind

    Grey with alpha becomes RGBA. Colour profiles and camera orientation are ignored, as for any texture.
    """
    image: Pixels = _apply_codec(path, read_bytes(path), decode_exr, decode_radiance, decode_with_pillow)
    return image[..., None] if image.ndim == 2 else image


def read_size(path: str | Path | EmbeddedPicture) -> tuple[int, int]:
    """Width and height of a picture by its header; its pixels may be damaged all the same.

    DermisError : the file is missing, is no picture, or is larger than one may be
    """
    size: tuple[int, int] = _apply_codec(path, read_bytes(path), exr_size, radiance_size, pillow_size)
    return size


def _apply_codec(
    path: str | Path | EmbeddedPicture,
    data: bytes,
    exr: Callable[[bytes], T],
    radiance: Callable[[bytes], T],
    pillow: Callable[[bytes], T],
) -> T:
    """What the codec of the kind that the bytes begin as says of them."""
    kinds = {EXR_SIGNATURE: exr, RADIANCE_SIGNATURE: radiance} | dict.fromkeys(PILLOW_SIGNATURES, pillow)
    codec = next((codec for start, codec in kinds.items() if data.startswith(start)), None)
    if codec is None or (codec is exr and isinstance(path, EmbeddedPicture)):
        refuse(path, _READABLE, "its first bytes match none of these", "Convert it to PNG")
    try:
        return codec(data)
    except TooLargeError as fault:
        refuse(path, "a picture of as many pixels as 8192 x 8192 at most", str(fault), "Resize it")
    except DermisError as fault:  # a package is missing
        raise DermisError(f"{path}: {fault}") from fault
    except Exception as fault:  # decoders raise anything for damaged data
        raise DermisError(
            f"{path}: expected {_READABLE}, but it cannot be decoded ({outputs.reason(fault)}). "
            "It is cut off, damaged or of an unusual kind: fetch or export it again."
        ) from fault


def check_output(path: str | Path) -> Path:
    """The path, once a trial has shown that a picture can be written there: call it before a long rendering.

    DermisError : the suffix is none of `OUTPUT_SUFFIXES`, or the folder is missing or not writable
    """
    return outputs.check_output(path, OUTPUT_SUFFIXES, "Choose .png to look at, .exr to work with")


def write_image(path: str | Path, linear: NDArray[np.floating]) -> None:
    """Write a linear picture: .png as 8-bit sRGB rounded to nearest, .exr as linear float32.

    linear : (H, W, 3) or (H, W, 4), Rec. 709; alpha is stored as it is, not through the sRGB curve. Bytes
        are sRGB already, and go to a .png as they are
    DermisError : as for `check_output`, or the disk is full; nothing half-written stays behind
    """
    if not isinstance(path, str | os.PathLike):
        actual = f"got a {type(path).__name__} first"
        refuse(
            "write_image", "the file's name, then the picture", actual, 'Write write_image("face.png", image)'
        )
    linear = np.asarray(linear)
    if linear.ndim not in (2, 3) or linear.dtype.kind not in "fu":
        actual = f"got shape {linear.shape} and type {linear.dtype}"
        refuse(path, "a picture (H, W, 3 or 4) of floats", actual, "Check what is to be written")
    if linear.dtype.kind == "u":
        if linear.dtype != np.uint8 or check_output(path).suffix.lower() == ".exr":
            actual = f"got {linear.dtype}, which is encoded already"
            refuse(
                path, "linear floats", actual, "Take render_many(..., linear=True), or write a .png of bytes"
            )
        write_png(path, linear)
        return
    if check_output(path).suffix.lower() == ".exr":
        write_exr(path, linear)
        return
    levels = encode_srgb8(linear)
    if linear.shape[-1] == 4:
        levels[..., 3] = np.rint(np.clip(linear[..., 3], 0, 1) * 255)
    write_png(path, levels)


def write_png(path: str | Path, levels: Numbers, effort: int = 6) -> None:
    """Write grey levels as they are to an 8- or 16-bit PNG, by dtype.

    levels : (H, W), or (H, W, C) with C of 1, 3 or 4; uint8 or uint16
    effort : of the compression of 8 bits, from 1 (fast) to 9 (small files)
    """
    image = levels[..., None] if levels.ndim == 2 else levels
    if image.ndim != 3 or image.shape[2] not in (1, 3, 4) or image.dtype not in (np.uint8, np.uint16):
        actual = f"they have shape {levels.shape} and type {levels.dtype}"
        refuse(path, "pixels (H, W, 1, 3 or 4) of uint8 or uint16", actual, "Convert them first")
    data = encode_png(image, effort)
    with outputs.atomic_file(path) as temporary:
        temporary.write_bytes(data)


def write_exr(
    path: str | Path,
    linear: NDArray[np.floating],
    layers: Mapping[str, NDArray[np.floating]] | None = None,
    swift: bool = False,
) -> None:
    """Write a linear float32 OpenEXR file, compressed without loss.

    linear : (H, W, 3) or (H, W, 4), Rec. 709, stored as channels R, G, B (and A)
    layers : further pictures by name, (H, W) as one channel, (H, W, 3) as name.R, name.G, name.B
    swift : compress runs of equal bytes only: half the time, and 4 % more bytes for a rendered head
    """
    import OpenEXR

    if linear.ndim != 3 or linear.shape[2] not in (3, 4):
        refuse(path, "pixels (H, W, 3 or 4)", f"they have shape {linear.shape}", "Stack them first")
    pictures = {"RGB" if linear.shape[2] == 3 else "RGBA": linear} | dict(layers or {})
    channels = {name: np.ascontiguousarray(picture, np.float32) for name, picture in pictures.items()}
    compression = OpenEXR.RLE_COMPRESSION if swift else OpenEXR.ZIP_COMPRESSION
    header = {"compression": compression, "type": OpenEXR.scanlineimage}
    with outputs.atomic_file(path) as temporary:
        OpenEXR.File(header, channels).write(str(temporary))


def encode_exr_parts(parts: Mapping[str, Mapping[str, Numbers]], swift: bool = False) -> bytes:
    """A float32 OpenEXR file of several pictures, compressed without loss; of one, a file of one part.

    parts : channels (H, W) by name, of each part by its name; the first is what other programs show
    swift : as of `write_exr`
    """
    import OpenEXR

    compression = OpenEXR.RLE_COMPRESSION if swift else OpenEXR.ZIP_COMPRESSION
    header = {"compression": compression, "type": OpenEXR.scanlineimage}
    made = [
        OpenEXR.Part(
            dict(header), {key: np.ascontiguousarray(one, np.float32) for key, one in channels.items()}, name
        )
        for name, channels in parts.items()
    ]
    into = io.BytesIO()
    OpenEXR.File(made).write(into)
    return into.getvalue()


def read_bytes(path: str | Path | EmbeddedPicture) -> bytes:
    """The picture file as it is.

    DermisError : it cannot be read
    """
    if isinstance(path, EmbeddedPicture):
        return path.data
    return read_file(path, _READABLE, MAX_FILE_BYTES)
