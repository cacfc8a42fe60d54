"""Pixels from the bytes of picture files and back, by libraries that keep every bit."""

from __future__ import annotations

import io
import re
import struct
import threading
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.extras import needed

Pixels = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]

MAX_PIXELS = 16384**2
_PNG_START = b"\x89PNG\r\n\x1a\n"
_PNG_KINDS = {1: 0, 3: 2, 4: 6}  # by channels
_UP = 2  # PNG's number for differences from the row above
EXR_START = b"\x76\x2f\x31\x01"
PILLOW_STARTS = (_PNG_START, b"\xff\xd8\xff", b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")

_PILLOW_LOCK = threading.Lock()
RADIANCE_START = b"#?"


def decode_exr(path: Path) -> NDArray[np.float32]:
    """(H, W, 1, 3 or 4) of the channels Y, RGB or RGBA of an OpenEXR file.

    path : the file; the library reads no bytes
    ValueError : there are no such channels, or the data are damaged
    """
    import OpenEXR

    file = OpenEXR.File(str(path), separate_channels=True)
    if not file.parts:
        raise ValueError("its pixels are cut off or damaged")
    channels = file.channels()
    names = next((names for names in ("RGBA", "RGB", "Y") if set(names) <= channels.keys()), None)
    if names is None:
        raise ValueError(f"it has channels {', '.join(sorted(channels))}, not R, G, B or Y")
    return np.stack([channels[name].pixels for name in names], axis=-1).astype(np.float32)


def decode_with_pillow(data: bytes) -> Pixels:
    """(H, W) or (H, W, 3 or 4) of a PNG, JPEG or TIFF file, with all bits of its pixels.

    data : the whole file
    ValueError, OSError and others : the data are damaged or hold pixels of another kind
    """
    picture = _open(data)
    deep = _format_of_16_bit(data, picture)
    if deep:
        return _decode_16_bit(data, deep)
    if picture.mode in ("P", "PA", "LA", "La"):
        alpha = picture.mode != "P" or "transparency" in picture.info
        picture = picture.convert("RGBA" if alpha else "RGB")
    picture = picture.convert("L") if picture.mode == "1" else picture
    if picture.mode not in ("L", "RGB", "RGBA", "I;16", "I;16B", "F"):
        raise ValueError(f"its pixels are of kind {picture.mode}, not 8 or 16 bit grey, RGB or RGBA")
    array = np.array(picture)
    return array.astype(np.uint16) if picture.mode.startswith("I;16") else array


def _open(data: bytes) -> Any:
    """The picture opened by Pillow: its header is read and its size accepted."""
    picture = _open_header(data)
    if picture.width * picture.height > MAX_PIXELS:
        raise ValueError(f"it has {picture.width} x {picture.height} pixels, more than 16384 x 16384")
    if picture.format == "PNG":
        _open_header(data).verify()  # the checksums, which Pillow leaves out when it decodes
    return picture


def _open_header(data: bytes) -> Any:
    import PIL.Image

    with _PILLOW_LOCK:  # Pillow's own limit is a global, and lower than a large height map
        limit, PIL.Image.MAX_IMAGE_PIXELS = PIL.Image.MAX_IMAGE_PIXELS, None
        try:
            return PIL.Image.open(io.BytesIO(data), formats=("PNG", "JPEG", "TIFF"))
        except PIL.UnidentifiedImageError as fault:
            raise ValueError("its header cannot be read") from fault
        finally:
            PIL.Image.MAX_IMAGE_PIXELS = limit


def _format_of_16_bit(data: bytes, picture: Any) -> str | None:
    """FFmpeg's name of the pixel format where Pillow would drop the lower 8 of 16 bits, else None."""
    if data.startswith(_PNG_START):
        depth, kind = data[24], data[25]
        return {0: "gray16le", 2: "rgb48le", 4: "ya16le", 6: "rgba64le"}[kind] if depth == 16 else None
    bits = picture.tag_v2.get(258, ()) if picture.format == "TIFF" else ()
    return {3: "rgb48le", 4: "rgba64le"}.get(len(bits)) if 16 in bits else None


def _decode_16_bit(data: bytes, pixel_format: str) -> NDArray[np.uint16]:
    av = needed("av", "a picture with 16 bits of colour")
    # bytes, not the path: FFmpeg would take a percent sign in a name for a numbered sequence
    with av.open(io.BytesIO(data)) as container:
        image: NDArray[np.uint16] = next(container.decode(video=0)).to_ndarray(format=pixel_format)
    return image[..., [0, 0, 0, 1]] if pixel_format == "ya16le" else image


def encode_png(levels: NDArray[Any], effort: int = 6) -> bytes:
    """A PNG file of (H, W, 1, 3 or 4) uint8 or uint16.

    effort : of the compression, from 1 (fast) to 9 (small files)

    Each row is stored as its difference from the one above: for rendered pictures the files are as small as
    those of libraries that try every filter on every row, in a third to half of the time.
    """
    height, width, channels = levels.shape
    bits = 8 * levels.itemsize
    rows = levels.astype(levels.dtype.newbyteorder(">")).reshape(height, -1).view(np.uint8)
    filtered = np.full((height, 1 + rows.shape[1]), _UP, np.uint8)
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])
    header = struct.pack(">IIBBBBB", width, height, bits, _PNG_KINDS[channels], 0, 0, 0)
    pixels = zlib.compress(filtered.data, effort)  # releases the GIL
    return _PNG_START + _chunk(b"IHDR", header) + _chunk(b"IDAT", pixels) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png_size(data: bytes) -> tuple[int, int]:
    """Width and height of a PNG file whose bytes are all there, by its checksums; pixels are not decoded.

    ValueError : it is another file, cut off or damaged
    """
    if not data.startswith(_PNG_START):
        raise ValueError("its first bytes are not those of PNG")
    view, place, kind = memoryview(data), len(_PNG_START), b""
    while kind != b"IEND":
        if place + 12 > len(data):
            raise ValueError("it is cut off")
        (length,), kind = struct.unpack_from(">I", data, place), data[place + 4 : place + 8]
        end = place + 8 + length
        if data[end : end + 4] != struct.pack(">I", zlib.crc32(view[place + 4 : end])):
            raise ValueError(f"its part {kind!r} is damaged")
        place = end + 4
    width, height = struct.unpack_from(">II", data, 16)
    return width, height


def decode_radiance(data: bytes) -> NDArray[np.float32]:
    """Linear radiance (H, W, 3) of the bytes of a .hdr file, divided by its EXPOSURE.

    data : the whole file, in the top-down left-to-right order that programs write
    ValueError : the data are cut off, damaged, or in another order or colour space

    Ours rather than FFmpeg's, which accepts a file that lacks its last bytes.
    """
    height, width, exposure, start = _header(data)
    if height * width > MAX_PIXELS:
        raise ValueError(f"it has {width} x {height} pixels")
    rgbe = _scanlines(data, start, height, width)
    # A mantissa byte counts 1/256 of 2^(E - 128); E = 0 means black, and 2^-136 is black in any case.
    scale = np.ldexp(np.float32(1 / exposure), rgbe[..., 3].astype(np.int32) - 136)
    return np.multiply(rgbe[..., :3], scale[..., None], dtype=np.float32)


def _header(data: bytes) -> tuple[int, int, float, int]:
    """(height, width, exposure, where the pixels begin)."""
    found = re.search(rb"\n\n-Y (\d+) \+X (\d+)\n", data[:65536])
    if not found:
        raise ValueError("its header has no size of the form -Y height +X width")
    lines = data[: found.start()].splitlines()
    if b"FORMAT=32-bit_rle_rgbe" not in lines:
        raise ValueError("its header does not say FORMAT=32-bit_rle_rgbe")
    exposures = [float(line[9:]) for line in lines if line.startswith(b"EXPOSURE=")]
    return int(found[1]), int(found[2]), float(np.prod(exposures)), found.end()


def _scanlines(data: bytes, at: int, height: int, width: int) -> NDArray[np.uint8]:
    """(H, W, 4) bytes, from run-length coded scanlines or plain ones."""
    coded = data[at : at + 4] == bytes((2, 2, width >> 8 & 255, width & 255)) and 8 <= width < 32768
    if not coded:
        return _plain(data, at, height, width)
    planes = np.empty((height, 4, width), np.uint8)
    for row in planes:
        if data[at : at + 2] != b"\x02\x02":
            raise ValueError("a scanline does not begin as it should")
        at += 4
        for plane in row:
            at = _runs(data, at, plane)
    return planes.transpose(0, 2, 1)


def _runs(data: bytes, at: int, plane: NDArray[np.uint8]) -> int:
    """Fill one channel of one scanline; where the next begins."""
    x, width = 0, plane.size
    while x < width:
        if at + 1 >= len(data):
            raise ValueError("it ends in the middle")
        count, repeated = data[at], data[at] > 128
        count = count - 128 if repeated else count
        if count == 0 or x + count > width:
            raise ValueError("a run is longer than its scanline")
        if repeated:
            plane[x : x + count] = data[at + 1]
        else:
            plane[x : x + count] = np.frombuffer(data, np.uint8, count, at + 1)
        at += 2 if repeated else 1 + count
        x += count
    return at


def _plain(data: bytes, at: int, height: int, width: int) -> NDArray[np.uint8]:
    pixels = np.frombuffer(data, np.uint8, height * width * 4, at).reshape(height, width, 4)
    # (1, 1, 1, n) repeats a pixel in files from before 1991; no program of today writes it.
    if np.any(np.all(pixels[..., :3] == 1, axis=-1)):
        raise ValueError("its pixels are in the old run-length code")
    return pixels
