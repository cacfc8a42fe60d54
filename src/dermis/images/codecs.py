"""Decoding of PNG, JPEG, TIFF, WebP, AVIF and HEIC files at full bit depth, and encoding of PNG files."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Bytes, Floats, Numbers
from dermis.base.extras import import_extra
from dermis.images.header import UnsupportedError
from dermis.images.opening import PNG_SIGNATURE, lookup_table_transform, open_picture
from dermis.images.sizes import MAX_PIXELS, check_size

if TYPE_CHECKING:
    from PIL.Image import Image

Pixels = Bytes | NDArray[np.uint16] | Floats

_PNG_COLOUR_TYPES = {1: 0, 2: 4, 3: 2, 4: 6}  # by number of channels
_PNG_UP_FILTER = 2  # PNG's code of the filter that stores differences from the row above

_PIXELS_PER_STRIP = 1 << 20  # pixels converted at a time
_CHANNELS_OF_16_BIT_FORMATS = {"gray16": 1, "rgb48": 3, "ya16": 2, "rgba64": 4}  # by FFmpeg's pixel format
_PILLOW_PIXEL_MODES: dict[str, tuple[str, type[np.generic]]] = {
    "1": ("L", np.uint8),
    "L": ("L", np.uint8),
    "RGB": ("RGB", np.uint8),
    "RGBX": ("RGB", np.uint8),
    "RGBA": ("RGBA", np.uint8),
    "RGBa": ("RGBA", np.uint8),
    "P": ("RGB", np.uint8),
    "PA": ("RGBA", np.uint8),
    "LA": ("RGBA", np.uint8),
    "La": ("RGBA", np.uint8),
    "CMYK": ("RGB", np.uint8),
    "YCbCr": ("RGB", np.uint8),
    "I;16": ("I;16", np.uint16),
    "I;16B": ("I;16B", np.uint16),
    "F": ("F", np.float32),
}
"""For each Pillow mode of a file, the mode to which it is converted and the NumPy type of the pixels."""
_CHANNELS_OF_PNG_COLOUR_TYPES = {0: 1, 2: 3, 6: 4}  # by PNG colour type
_TIFF_BITS, _TIFF_PHOTOMETRIC, _TIFF_RGB = 258, 262, 2


def decode_with_pillow(file_bytes: bytes, convert_lookup_tables: bool = False) -> Pixels:
    """Decode a picture at full bit depth to an array (H, W, C), in the colour space that its header states.

    C is 1, 3 or 4; the type is uint8, uint16, or float32 for a float TIFF. CMYK becomes sRGB.

    convert_lookup_tables : whether to convert to 8-bit sRGB if the file's ICC profile has lookup tables

    Raises ValueError, OSError and other errors for a file that is damaged, too large or of an unsupported
    type.
    """
    picture = open_picture(file_bytes)
    if picture.format == "PNG":
        open_picture(file_bytes).verify()  # the checksums, which Pillow does not check when it decodes
    to_srgb = lookup_table_transform(picture) if convert_lookup_tables or picture.mode == "CMYK" else None
    pixel_format = None if to_srgb else _ffmpeg_format_of_16_bit(file_bytes, picture)
    if pixel_format:
        image = decode_up_filtered_png(file_bytes)
        return _decode_16_bit(file_bytes, pixel_format, picture) if image is None else image
    if picture.mode not in _PILLOW_PIXEL_MODES:
        raise UnsupportedError(f"its pixels are of kind {picture.mode}")
    mode, dtype = _PILLOW_PIXEL_MODES[picture.mode]
    if picture.mode == "P" and "transparency" in picture.info:
        mode = "RGBA"
    picture.load()
    channels = {"RGB": 3, "RGBA": 4}.get(mode, 1)
    image = np.empty((picture.height, picture.width, channels), dtype)
    for rows in row_strips(image):
        strip = picture.crop((0, rows.start, picture.width, rows.stop))
        strip = to_srgb.apply(strip) if to_srgb else strip
        strip = strip if strip.mode == mode else strip.convert(mode)
        image[rows] = np.asarray(strip).reshape(image[rows].shape)
    return image


def row_strips(image: Numbers) -> Iterator[slice]:
    """Yield slices that divide the rows of an array into strips of about a million pixels.

    Strips of this size are large enough for fast array operations, and need little memory.
    """
    rows = max(1, _PIXELS_PER_STRIP // max(1, image.shape[1]))
    for top in range(0, len(image), rows):
        yield slice(top, min(top + rows, len(image)))


def _ffmpeg_format_of_16_bit(file_bytes: bytes, picture: Image) -> str | None:
    """Return FFmpeg's name for the pixel format of a 16-bit picture; None for other pictures.

    Pillow would reduce 16-bit colours to 8 bits, so FFmpeg decodes these pictures.
    """
    if file_bytes.startswith(PNG_SIGNATURE):
        depth, kind = file_bytes[24], file_bytes[25]
        return {0: "gray16", 2: "rgb48", 4: "ya16", 6: "rgba64"}[kind] if depth == 16 else None
    tags = getattr(picture, "tag_v2", {})
    bits = tags.get(_TIFF_BITS, ()) if tags.get(_TIFF_PHOTOMETRIC) == _TIFF_RGB else ()
    return {3: "rgb48", 4: "rgba64"}.get(len(bits)) if 16 in bits else None


def _decode_16_bit(file_bytes: bytes, pixel_format: str, picture: Image) -> NDArray[np.uint16]:
    av = import_extra("av", "a picture with 16 bits of colour")
    # FFmpeg gets bytes, because it treats names with percent signs as numbered sequences, and a format,
    # because some of the formats that it guesses open other files
    with av.open(io.BytesIO(file_bytes), format=f"{picture.format}_pipe".lower()) as container:
        container.streams.video[0].codec_context.options = {"max_pixels": str(MAX_PIXELS)}
        frame = next(container.decode(video=0))
    if (frame.width, frame.height) != picture.size:
        raise ValueError("its header is damaged")
    if frame.format.name not in (f"{pixel_format}le", f"{pixel_format}be"):
        frame = frame.reformat(format=f"{pixel_format}le")
    plane, channels = frame.planes[0], _CHANNELS_OF_16_BIT_FORMATS[pixel_format]
    stored = np.frombuffer(plane, "<u2" if frame.format.name.endswith("le") else ">u2")
    rows = stored.reshape(frame.height, plane.line_size // 2)[:, : frame.width * channels]
    levels = rows.reshape(frame.height, frame.width, channels)
    if pixel_format == "ya16":
        return levels[..., [0, 0, 0, 1]].astype(np.uint16)
    return levels.astype(np.uint16)


def encode_png(pixel_levels: Numbers, zlib_level: int = 6, use_isal: bool = False) -> bytes:
    """Encode a picture (H, W, C) of uint8 or uint16 with 1 to 4 channels as a PNG file.

    zlib_level : compression level of zlib, from 1 (fast) to 9 (small files)
    use_isal : whether to compress with ISA-L instead of zlib; for rendered pictures, ISA-L is four times as
        fast as zlib at level 1. ISA-L is among the optional dependencies "batch" of this package

    PNG's "up" filter is used: each row is stored as the difference from the row above. For rendered pictures,
    the files are as small as if the best filter were chosen for each row, and encoding is twice as fast.
    """
    height, width, channels = pixel_levels.shape
    bits = 8 * pixel_levels.itemsize
    rows = pixel_levels.astype(pixel_levels.dtype.newbyteorder(">")).reshape(height, -1).view(np.uint8)
    filtered = np.full((height, 1 + rows.shape[1]), _PNG_UP_FILTER, np.uint8)
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])
    header = struct.pack(">IIBBBBB", width, height, bits, _PNG_COLOUR_TYPES[channels], 0, 0, 0)
    library, level = (import_extra("isal.isal_zlib", "a data set"), 1) if use_isal else (zlib, zlib_level)
    pixels = library.compress(filtered.data, level)  # releases the GIL
    return (
        PNG_SIGNATURE + _png_chunk(b"IHDR", header) + _png_chunk(b"IDAT", pixels) + _png_chunk(b"IEND", b"")
    )


def _png_chunk(chunk_type: bytes, chunk_data: bytes) -> bytes:
    return (
        struct.pack(">I", len(chunk_data))
        + chunk_type
        + chunk_data
        + struct.pack(">I", zlib.crc32(chunk_type + chunk_data))
    )


def png_size(file_bytes: bytes) -> tuple[int, int]:
    """Return width and height of a PNG file after checking its chunks; pixels are not decoded.

    Raises ValueError for a file that is not PNG, truncated or damaged.
    """
    if not file_bytes.startswith(PNG_SIGNATURE):
        raise ValueError("its first bytes are not those of PNG")
    for _ in png_chunks(file_bytes):
        pass
    width, height = struct.unpack_from(">II", file_bytes, 16)
    return width, height


def decode_up_filtered_png(file_bytes: bytes) -> Bytes | NDArray[np.uint16] | None:
    """Decode a PNG file in which all rows use the "up" filter, as in files that `encode_png` writes.

    The result is an array (H, W, C) of uint8 or uint16 with 1, 3 or 4 channels, or None for a file with other
    filters.

    Raises ValueError when the file is damaged or too large.
    """
    if not file_bytes.startswith(PNG_SIGNATURE) or len(file_bytes) < 33:
        return None
    width, height, bits, colour, *methods = struct.unpack_from(">IIBBBBB", file_bytes, 16)
    if bits not in (8, 16) or colour not in _CHANNELS_OF_PNG_COLOUR_TYPES or methods != [0, 0, 0]:
        return None
    check_size(width, height)
    channels = _CHANNELS_OF_PNG_COLOUR_TYPES[colour]
    step = 1 + width * channels * bits // 8
    compressed = _compressed_pixels(file_bytes)
    if compressed is None:
        return None
    decompressor = zlib.decompressobj()
    try:
        stored = decompressor.decompress(compressed, height * step + 1)
    except zlib.error as fault:
        raise ValueError("its pixels are damaged") from fault
    if len(stored) != height * step:
        raise ValueError("its pixels are truncated, or there are too many")
    rows = np.frombuffer(stored, np.uint8).reshape(height, step)
    if (rows[:, 0] != _PNG_UP_FILTER).any():
        return None
    pixels = np.add.accumulate(rows[:, 1:], axis=0, dtype=np.uint8)
    levels = pixels.view(">u2").astype(np.uint16) if bits == 16 else pixels
    return levels.reshape(height, width, channels)


def _compressed_pixels(file_bytes: bytes) -> bytes | None:
    """Return the compressed pixels of a PNG file; None for a file in which a tRNS chunk sets transparency."""
    parts = list[memoryview]()
    for kind, content in png_chunks(file_bytes):
        if kind == b"tRNS":
            return None
        if kind == b"IDAT":
            parts.append(content)
    return b"".join(parts)


def png_chunks(file_bytes: bytes) -> Iterator[tuple[bytes, memoryview]]:
    """Yield type and data of each chunk of a PNG file after checking its checksum.

    Raises ValueError when the file is truncated or damaged.
    """
    view, offset, kind = memoryview(file_bytes), len(PNG_SIGNATURE), b""
    while kind != b"IEND":
        if offset + 12 > len(file_bytes):
            raise ValueError("it is truncated")
        (length,), kind = struct.unpack_from(">I", file_bytes, offset), file_bytes[offset + 4 : offset + 8]
        end = offset + 8 + length
        if file_bytes[end : end + 4] != struct.pack(">I", zlib.crc32(view[offset + 4 : end])):
            raise ValueError(f"its chunk {kind!r} is damaged")
        yield kind, view[offset + 8 : end]
        offset = end + 4
