"""Pixels of PNG, JPEG and TIFF files from their bytes, and PNG files of pixels, with all bits kept."""

from __future__ import annotations

import io
import struct
import threading
import zlib
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Bytes, Floats, Numbers
from dermis.base.extras import import_extra
from dermis.images.sizes import MAX_PIXELS, check_size

if TYPE_CHECKING:
    from PIL.Image import Image

Pixels = Bytes | NDArray[np.uint16] | Floats

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
PILLOW_SIGNATURES = (PNG_SIGNATURE, b"\xff\xd8\xff", b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_PNG_KINDS = {1: 0, 3: 2, 4: 6}  # by channels
_UP_FILTER = 2  # PNG's number for differences from the row above

_PILLOW_LOCK = threading.Lock()
_STRIP_PIXELS = 1 << 20  # pixels converted at a time
_JPEG_SCAN = b"\xff\xda"
_MAX_SCANNED_PIXELS = 1 << 30  # pixels in all scans of a progressive JPEG: sixteen scans of the largest
_CHANNELS_OF_16_BIT = {"gray16": 1, "rgb48": 3, "ya16": 2, "rgba64": 4}
_MODES: dict[str, tuple[str, type[np.generic]]] = {
    "1": ("L", np.uint8),
    "L": ("L", np.uint8),
    "RGB": ("RGB", np.uint8),
    "RGBA": ("RGBA", np.uint8),
    "P": ("RGB", np.uint8),
    "PA": ("RGBA", np.uint8),
    "LA": ("RGBA", np.uint8),
    "La": ("RGBA", np.uint8),
    "I;16": ("I;16", np.uint16),
    "I;16B": ("I;16B", np.uint16),
    "F": ("F", np.float32),
}
"""What each of Pillow's kinds of pixel becomes."""
_CHANNELS = {0: 1, 2: 3, 6: 4}  # by PNG's kinds of colour


def decode_with_pillow(data: bytes) -> Pixels:
    """(H, W) or (H, W, 3 or 4) of a PNG, JPEG or TIFF file, with all bits of its pixels.

    data : the whole file
    ValueError, OSError and others : the data are damaged, too large, or hold pixels of another kind
    """
    picture = _open_checked(data)
    deep = _format_of_16_bit(data, picture)
    if deep:
        plain = decode_up_filtered_png(data)
        return _decode_16_bit(data, deep, picture) if plain is None else plain
    if picture.mode not in _MODES:
        raise ValueError(f"its pixels are of kind {picture.mode}, not 8 or 16 bit grey, RGB or RGBA")
    mode, kind = _MODES[picture.mode]
    if picture.mode == "P" and "transparency" in picture.info:
        mode = "RGBA"
    picture.load()
    channels = {"RGB": 3, "RGBA": 4}.get(mode, 1)
    image = np.empty((picture.height, picture.width, channels), kind)
    for rows in strips(image):
        strip = picture.crop((0, rows.start, picture.width, rows.stop))
        strip = strip if strip.mode == mode else strip.convert(mode)
        image[rows] = np.asarray(strip).reshape(image[rows].shape)
    return image


def pillow_size(data: bytes) -> tuple[int, int]:
    """Width and height of a PNG, JPEG or TIFF file by its header."""
    picture = _open_header(data)
    return check_size(picture.width, picture.height)


def strips(image: Numbers) -> Iterator[slice]:
    """Rows of a picture, some at a time: enough for whole arrays to be fast, too few to fill the memory."""
    rows = max(1, _STRIP_PIXELS // max(1, image.shape[1]))
    for top in range(0, len(image), rows):
        yield slice(top, min(top + rows, len(image)))


def _open_checked(data: bytes) -> Image:
    """The picture opened by Pillow: its header is read and its size accepted."""
    picture = _open_header(data)
    check_size(picture.width, picture.height)
    if picture.format == "PNG":
        _open_header(data).verify()  # the checksums, which Pillow leaves out when it decodes
    if (
        picture.format == "JPEG"
        and data.count(_JPEG_SCAN) * picture.width * picture.height > _MAX_SCANNED_PIXELS
    ):
        raise ValueError("it was stored in too many scans")
    return picture


def _open_header(data: bytes) -> Image:
    import PIL.Image

    with _PILLOW_LOCK:  # Pillow's own limit is a global, and other than ours
        limit, PIL.Image.MAX_IMAGE_PIXELS = PIL.Image.MAX_IMAGE_PIXELS, None
        try:
            return PIL.Image.open(io.BytesIO(data), formats=("PNG", "JPEG", "TIFF"))
        except PIL.UnidentifiedImageError as fault:
            raise ValueError("its header cannot be read") from fault
        finally:
            PIL.Image.MAX_IMAGE_PIXELS = limit


def _format_of_16_bit(data: bytes, picture: Image) -> str | None:
    """FFmpeg's name of the pixel format where Pillow would drop the lower 8 of 16 bits, else None."""
    if data.startswith(PNG_SIGNATURE):
        depth, kind = data[24], data[25]
        return {0: "gray16", 2: "rgb48", 4: "ya16", 6: "rgba64"}[kind] if depth == 16 else None
    bits = getattr(picture, "tag_v2", {}).get(258, ())
    return {3: "rgb48", 4: "rgba64"}.get(len(bits)) if 16 in bits else None


def _decode_16_bit(data: bytes, pixel_format: str, picture: Image) -> NDArray[np.uint16]:
    av = import_extra("av", "a picture with 16 bits of colour")
    # bytes, not the path: FFmpeg would take a percent sign in a name for a numbered sequence; and one format,
    # not what it guesses from them, as some of its formats open other files
    with av.open(io.BytesIO(data), format=f"{picture.format}_pipe".lower()) as container:
        container.streams.video[0].codec_context.options = {"max_pixels": str(MAX_PIXELS)}
        frame = next(container.decode(video=0))
    if (frame.width, frame.height) != picture.size:
        raise ValueError("its header is damaged")
    if frame.format.name not in (f"{pixel_format}le", f"{pixel_format}be"):
        frame = frame.reformat(format=f"{pixel_format}le")
    plane, channels = frame.planes[0], _CHANNELS_OF_16_BIT[pixel_format]
    stored = np.frombuffer(plane, "<u2" if frame.format.name.endswith("le") else ">u2")
    rows = stored.reshape(frame.height, plane.line_size // 2)[:, : frame.width * channels]
    levels = rows.reshape(frame.height, frame.width, channels)
    if pixel_format == "ya16":
        return levels[..., [0, 0, 0, 1]].astype(np.uint16)
    return levels.astype(np.uint16)


def encode_png(levels: Numbers, effort: int = 6, quick: bool = False) -> bytes:
    """A PNG file of (H, W, 1, 3 or 4) uint8 or uint16.

    effort : of zlib's compression, from 1 (fast) to 9 (small files)
    quick : compress by ISA-L instead, of the extra "batch": rendered pictures and their normals take a
        quarter of the time that zlib takes at its fastest, and the files are no larger

    Each row is stored as its difference from the one above: for rendered pictures the files are as small as
    those of libraries that try every filter on every row, in a third to half of the time.
    """
    height, width, channels = levels.shape
    bits = 8 * levels.itemsize
    rows = levels.astype(levels.dtype.newbyteorder(">")).reshape(height, -1).view(np.uint8)
    filtered = np.full((height, 1 + rows.shape[1]), _UP_FILTER, np.uint8)
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])
    header = struct.pack(">IIBBBBB", width, height, bits, _PNG_KINDS[channels], 0, 0, 0)
    packer, strength = (import_extra("isal.isal_zlib", "a data set"), 1) if quick else (zlib, effort)
    pixels = packer.compress(filtered.data, strength)  # releases the GIL
    return PNG_SIGNATURE + _chunk(b"IHDR", header) + _chunk(b"IDAT", pixels) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png_size(data: bytes) -> tuple[int, int]:
    """Width and height of a PNG file whose bytes are all there, by its checksums; pixels are not decoded.

    ValueError : it is another file, cut off or damaged
    """
    if not data.startswith(PNG_SIGNATURE):
        raise ValueError("its first bytes are not those of PNG")
    for _ in png_chunks(data):
        pass
    width, height = struct.unpack_from(">II", data, 16)
    return width, height


def decode_up_filtered_png(data: bytes) -> Bytes | NDArray[np.uint16] | None:
    """(H, W, 1, 3 or 4) uint8 or uint16; None for PNG files of other forms, and for other files.

    data : of which the checksums are tested
    ValueError : it is damaged, or too large
    """
    if not data.startswith(PNG_SIGNATURE) or len(data) < 33:
        return None
    width, height, bits, colour, *how = struct.unpack_from(">IIBBBBB", data, 16)
    if bits not in (8, 16) or colour not in _CHANNELS or how != [0, 0, 0]:
        return None
    check_size(width, height)
    channels = _CHANNELS[colour]
    step = 1 + width * channels * bits // 8
    packed = _compressed_pixels(data)
    if packed is None:
        return None
    unpacker = zlib.decompressobj()
    try:
        stored = unpacker.decompress(packed, height * step + 1)
    except zlib.error as fault:
        raise ValueError("its pixels are damaged") from fault
    if len(stored) != height * step:
        raise ValueError("its pixels are cut off, or more than it says")
    rows = np.frombuffer(stored, np.uint8).reshape(height, step)
    if (rows[:, 0] != _UP_FILTER).any():
        return None
    pixels = np.add.accumulate(rows[:, 1:], axis=0, dtype=np.uint8)
    levels = pixels.view(">u2").astype(np.uint16) if bits == 16 else pixels
    return levels.reshape(height, width, channels)


def _compressed_pixels(data: bytes) -> bytes | None:
    """The compressed pixels; None where other parts that change them are there."""
    packed = list[memoryview]()
    for kind, part in png_chunks(data):
        if kind == b"tRNS":
            return None
        if kind == b"IDAT":
            packed.append(part)
    return b"".join(packed)


def png_chunks(data: bytes) -> Iterator[tuple[bytes, memoryview]]:
    """Kind and content of each part of a PNG file up to its end, by their checksums.

    ValueError : it is cut off or damaged
    """
    view, place, kind = memoryview(data), len(PNG_SIGNATURE), b""
    while kind != b"IEND":
        if place + 12 > len(data):
            raise ValueError("it is cut off")
        (length,), kind = struct.unpack_from(">I", data, place), data[place + 4 : place + 8]
        end = place + 8 + length
        if data[end : end + 4] != struct.pack(">I", zlib.crc32(view[place + 4 : end])):
            raise ValueError(f"its part {kind!r} is damaged")
        yield kind, view[place + 8 : end]
        place = end + 4
