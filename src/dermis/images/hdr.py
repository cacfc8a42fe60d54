"""Decoding and encoding of OpenEXR and Radiance files; headers are checked before pixels are decoded."""

from __future__ import annotations

import io
import re
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Bytes, Floats, Index
from dermis.images.sizes import MAX_PIXELS, TooLargeError, check_size

EXR_SIGNATURE = b"\x76\x2f\x31\x01"
_READABLE_CHANNELS = ("RGBA", "RGB", "Y")
_CHANNELS_BY_COUNT = {1: "Y", 3: "RGB"}  # by number of channels
_MAX_SAMPLES = 3 * MAX_PIXELS  # in all channels of all parts, because the library decodes all of them
_MAX_CHANNELS = 1024
RADIANCE_SIGNATURE = b"#?"
_MAX_HEADER = 1 << 16
_STRIP_PIXELS = 1 << 18  # pixels decoded at a time
_MAX_LITERAL = 128  # codes up to this count literal bytes, larger codes are runs
_DECODED_BYTES = [k if k <= _MAX_LITERAL else k - _MAX_LITERAL for k in range(256)]
_CODE_BYTES = [k + 1 if k <= _MAX_LITERAL else 2 for k in range(256)]


def decode_exr(data: bytes) -> Floats:
    """Decode an OpenEXR file with channels Y, RGB or RGBA to an array (H, W, 1, 3 or 4).

    Raises ValueError for a file with other channels, and for one that is too large or damaged.
    """
    import OpenEXR

    names = _check_exr_header(_exr_header(data))
    file = OpenEXR.File(io.BytesIO(data), separate_channels=True)
    if not file.parts:
        raise ValueError("its pixels are truncated or damaged")
    channels = file.channels()
    image = np.empty((*channels[names[0]].pixels.shape, len(names)), np.float32)
    for index, name in enumerate(names):
        image[..., index] = channels[name].pixels
    return image


def exr_size(data: bytes) -> tuple[int, int]:
    """Return width and height of an OpenEXR file after checking its header; pixels are not decoded."""
    file = _exr_header(data)
    _check_exr_header(file)
    return _window_size(file.parts[0].header["dataWindow"])


def _exr_header(data: bytes) -> Any:
    import OpenEXR

    return OpenEXR.File(io.BytesIO(data), separate_channels=True, header_only=True)


def _check_exr_header(file: Any) -> str:
    """Check the header of an OpenEXR file, and return the channels to decode: "RGBA", "RGB" or "Y".

    The size of all channels of all parts is limited, because the library decodes all of them.

    file : OpenEXR.File that was opened with header_only
    """
    samples = 0
    for part in file.parts:
        width, height = _window_size(part.header["dataWindow"])
        check_size(width, height)
        if "deep" in str(part.header.get("type", "")).lower():
            raise ValueError("it has deep samples, not pixels")
        tiles = part.header.get("tiles")
        if tiles is not None:
            check_size(tiles.xSize, tiles.ySize)
        samples += width * height * len(part.header["channels"])
    if not file.parts:
        raise ValueError("its header is truncated or damaged")
    if samples > _MAX_SAMPLES:
        raise TooLargeError(f"all its channels have {samples / 1e6:.0f} million numbers")
    channels = {channel.name: channel for channel in file.parts[0].header["channels"]}
    names = next((names for names in _READABLE_CHANNELS if set(names) <= channels.keys()), None)
    if names is None or len(channels) > _MAX_CHANNELS:
        listed = ", ".join(sorted(channels)[:20])
        raise ValueError(f"it has channels {listed}, not R, G, B or Y")
    if any((channels[name].xSampling, channels[name].ySampling) != (1, 1) for name in names):
        raise ValueError("its channels have different sizes")
    return names


def _window_size(window: Any) -> tuple[int, int]:
    low, high = ([int(value) for value in corner] for corner in window)
    return high[0] - low[0] + 1, high[1] - low[1] + 1


def encode_exr(picture: NDArray[np.floating]) -> bytes:
    """Encode a picture (H, W, 1 or 3) of float16 or float32 as an OpenEXR file with channels Y or R, G, B.

    The compression is run-length encoding: for noisy pictures other methods are slower and no smaller.
    """
    import OpenEXR

    names = _CHANNELS_BY_COUNT[picture.shape[2]]
    channels = {name: np.ascontiguousarray(picture[..., k]) for k, name in enumerate(names)}
    header = {"compression": OpenEXR.RLE_COMPRESSION, "type": OpenEXR.scanlineimage}
    file = io.BytesIO()
    OpenEXR.File(header, channels).write(file)
    return file.getvalue()


def decode_radiance(data: bytes) -> Floats:
    """Decode a Radiance .hdr file to linear radiance (H, W, 3), divided by the EXPOSURE in its header.

    Rows must be top-down and pixels left to right, as programs write them. FFmpeg is not used because it
    accepts truncated files.

    Raises ValueError for a file that is truncated, damaged, or in another order or colour space.
    """
    height, width, exposure, offset = _radiance_header(data)
    compressed = data[offset : offset + 4] == _scanline_marker(width) and 8 <= width < 32768
    if len(data) - offset < height * (4 if compressed else 4 * width):
        raise ValueError("it is truncated")
    radiance = np.empty((height, width, 3), np.float32)
    rows = max(1, _STRIP_PIXELS // width)
    for top in range(0, height, rows):
        strip = radiance[top : top + rows]
        decode = _decode_runs if compressed else _decode_flat
        rgbe, offset = decode(data, offset, len(strip), width)
        # A mantissa byte is in units of 1/256 of 2^(E - 128); E = 0 means black, and 2^-136 is black as well.
        scale = np.ldexp(np.float32(1 / exposure), rgbe[..., 3].astype(np.int32) - 136)
        np.multiply(rgbe[..., :3], scale[..., None], out=strip)
    return radiance


def radiance_size(data: bytes) -> tuple[int, int]:
    """Return width and height of a Radiance .hdr file from its header."""
    height, width, _, _ = _radiance_header(data)
    return width, height


def _radiance_header(data: bytes) -> tuple[int, int, float, int]:
    """Parse the header of a Radiance .hdr file: height, width, exposure, and byte offset of the pixels."""
    found = re.search(rb"\n\n-Y (\d{1,9}) \+X (\d{1,9})\n", data[:_MAX_HEADER])
    if not found:
        raise ValueError("its header has no size of the form -Y height +X width")
    lines = data[: found.start()].splitlines()
    if b"FORMAT=32-bit_rle_rgbe" not in lines:
        raise ValueError("its header does not say FORMAT=32-bit_rle_rgbe")
    exposure = prod(float(line[9:]) for line in lines if line.startswith(b"EXPOSURE="))
    if not 1e-30 < exposure < 1e30:
        raise ValueError(f"its EXPOSURE is {exposure:g}")
    height, width = int(found[1]), int(found[2])
    check_size(width, height)
    return height, width, exposure, found.end()


def _scanline_marker(width: int) -> bytes:
    """Return the four bytes with which a run-length encoded scanline starts."""
    return bytes((2, 2, width >> 8 & 255, width & 255))


def _decode_runs(data: bytes, offset: int, height: int, width: int) -> tuple[Bytes, int]:
    """Decode run-length encoded scanlines to RGBE pixels (H, W, 4); also return the offset where they end.

    offset : byte at which the first scanline starts
    height : number of scanlines
    """
    starts: list[int] = []
    marker, append = _scanline_marker(width), starts.append
    for _ in range(height):
        if data[offset : offset + 4] != marker:
            raise ValueError("a scanline has an invalid start")
        offset += 4
        for _ in range(4):
            x = 0
            try:
                while x < width:
                    code = data[offset]
                    append(offset)
                    x += _DECODED_BYTES[code]
                    offset += _CODE_BYTES[code]
            except IndexError:
                raise ValueError("it is truncated") from None
            if x != width:
                raise ValueError("a run is longer than its scanline")
    if offset > len(data):
        raise ValueError("it is truncated")
    planes = _expand_runs(np.frombuffer(data, np.uint8), np.array(starts)).reshape(height, 4, width)
    return planes.transpose(0, 2, 1), offset


def _expand_runs(data: Bytes, starts: Index) -> Bytes:
    """Return the decoded bytes of run-length codes.

    data : bytes of the file
    starts : (n,) offset of each code in `data`
    """
    code = data[starts]
    count = np.array(_DECODED_BYTES)[code]
    if not count.all():
        raise ValueError("a run is empty")
    first = np.repeat(starts + 1, count)
    within = np.arange(len(first)) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(data[first + within * np.repeat(code <= _MAX_LITERAL, count)])


def _decode_flat(data: bytes, offset: int, height: int, width: int) -> tuple[Bytes, int]:
    pixels = np.frombuffer(data, np.uint8, height * width * 4, offset).reshape(height, width, 4)
    # (1, 1, 1, n) repeats a pixel in the format of before 1991, which current programs do not write.
    if np.any(np.all(pixels[..., :3] == 1, axis=-1)):
        raise ValueError("its pixels use the old run-length encoding")
    return pixels, offset + pixels.size
