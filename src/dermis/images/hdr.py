"""Pictures of linear light, OpenEXR and Radiance: headers are checked before pixels are decoded."""

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
_CHANNELS = ("RGBA", "RGB", "Y")
_NAMES = {1: "Y", 3: "RGB"}  # by channels
_MAX_SAMPLES = 3 * MAX_PIXELS  # in all channels of all parts: the library decodes all of them
_MAX_CHANNELS = 1024
RADIANCE_SIGNATURE = b"#?"
_MAX_HEADER = 1 << 16
_STRIP = 1 << 18  # pixels decoded at a time
_MAX_LITERAL = 128  # bytes that are not repeated; a larger number is that of a run
_COUNT = [k if k <= _MAX_LITERAL else k - _MAX_LITERAL for k in range(256)]
_STEP = [k + 1 if k <= _MAX_LITERAL else 2 for k in range(256)]


def decode_exr(data: bytes) -> Floats:
    """(H, W, 1, 3 or 4) of the channels Y, RGB or RGBA of an OpenEXR file.

    data : the whole file
    ValueError : there are no such channels, they are too large, or the data are damaged
    """
    import OpenEXR

    names = _check_exr_header(_exr_header(data))
    file = OpenEXR.File(io.BytesIO(data), separate_channels=True)
    if not file.parts:
        raise ValueError("its pixels are cut off or damaged")
    channels = file.channels()
    image = np.empty((*channels[names[0]].pixels.shape, len(names)), np.float32)
    for place, name in enumerate(names):
        image[..., place] = channels[name].pixels
    return image


def exr_size(data: bytes) -> tuple[int, int]:
    """Width and height of an OpenEXR file whose header is judged; pixels are not decoded."""
    file = _exr_header(data)
    _check_exr_header(file)
    return _window_size(file.parts[0].header["dataWindow"])


def _exr_header(data: bytes) -> Any:
    import OpenEXR

    return OpenEXR.File(io.BytesIO(data), separate_channels=True, header_only=True)


def _check_exr_header(file: Any) -> str:
    """The names of the channels to take, where all that the library decodes with them is no more than may be.

    file : opened for its header alone
    """
    numbers = 0
    for part in file.parts:
        width, height = _window_size(part.header["dataWindow"])
        check_size(width, height)
        if "deep" in str(part.header.get("type", "")).lower():
            raise ValueError("it holds deep samples, not pixels")
        tiles = part.header.get("tiles")
        if tiles is not None:
            check_size(tiles.xSize, tiles.ySize)
        numbers += width * height * len(part.header["channels"])
    if not file.parts:
        raise ValueError("its header is cut off or damaged")
    if numbers > _MAX_SAMPLES:
        raise TooLargeError(f"all its channels have {numbers / 1e6:.0f} million numbers")
    channels = {channel.name: channel for channel in file.parts[0].header["channels"]}
    names = next((names for names in _CHANNELS if set(names) <= channels.keys()), None)
    if names is None or len(channels) > _MAX_CHANNELS:
        told = ", ".join(sorted(channels)[:20])
        raise ValueError(f"it has channels {told}, not R, G, B or Y")
    if any((channels[name].xSampling, channels[name].ySampling) != (1, 1) for name in names):
        raise ValueError("its channels are of several sizes")
    return names


def _window_size(window: Any) -> tuple[int, int]:
    low, high = ([int(value) for value in corner] for corner in window)
    return high[0] - low[0] + 1, high[1] - low[1] + 1


def encode_exr(picture: NDArray[np.floating]) -> bytes:
    """An OpenEXR file of (H, W, 1 or 3) float16 or float32, as the channels Y or R, G, B.

    Runs of equal bytes alone are compressed: pictures with noise pack no better otherwise, and slower.
    """
    import OpenEXR

    channels = {
        name: np.ascontiguousarray(picture[..., k]) for k, name in enumerate(_NAMES[picture.shape[2]])
    }
    header = {"compression": OpenEXR.RLE_COMPRESSION, "type": OpenEXR.scanlineimage}
    file = io.BytesIO()
    OpenEXR.File(header, channels).write(file)
    return file.getvalue()


def decode_radiance(data: bytes) -> Floats:
    """Linear radiance (H, W, 3) of the bytes of a .hdr file, divided by its EXPOSURE.

    data : the whole file, in the top-down left-to-right order that programs write
    ValueError : the data are cut off, damaged, or in another order or colour space

    Ours rather than FFmpeg's, which accepts a file that lacks its last bytes.
    """
    height, width, exposure, at = _radiance_header(data)
    coded = data[at : at + 4] == _scanline_marker(width) and 8 <= width < 32768
    if len(data) - at < height * (4 if coded else 4 * width):
        raise ValueError("it ends in the middle")
    radiance = np.empty((height, width, 3), np.float32)
    rows = max(1, _STRIP // width)
    for top in range(0, height, rows):
        strip = radiance[top : top + rows]
        rgbe, at = (_decode_runs if coded else _decode_flat)(data, at, len(strip), width)
        # A mantissa byte counts 1/256 of 2^(E - 128); E = 0 means black, and 2^-136 is black in any case.
        scale = np.ldexp(np.float32(1 / exposure), rgbe[..., 3].astype(np.int32) - 136)
        np.multiply(rgbe[..., :3], scale[..., None], out=strip)
    return radiance


def radiance_size(data: bytes) -> tuple[int, int]:
    """Width and height of a .hdr file by its header."""
    height, width, _, _ = _radiance_header(data)
    return width, height


def _radiance_header(data: bytes) -> tuple[int, int, float, int]:
    """(height, width, exposure, where the pixels begin)."""
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
    """What a coded scanline begins with."""
    return bytes((2, 2, width >> 8 & 255, width & 255))


def _decode_runs(data: bytes, at: int, height: int, width: int) -> tuple[Bytes, int]:
    """(H, W, 4) bytes of scanlines, and where the next begins: runs are found one by one, filled at once."""
    starts: list[int] = []
    mark, add = _scanline_marker(width), starts.append
    for _ in range(height):
        if data[at : at + 4] != mark:
            raise ValueError("a scanline does not begin as it should")
        at += 4
        for _ in range(4):
            x = 0
            try:
                while x < width:
                    code = data[at]
                    add(at)
                    x += _COUNT[code]
                    at += _STEP[code]
            except IndexError:
                raise ValueError("it ends in the middle") from None
            if x != width:
                raise ValueError("a run is longer than its scanline")
    if at > len(data):
        raise ValueError("it ends in the middle")
    planes = _expand_runs(np.frombuffer(data, np.uint8), np.array(starts)).reshape(height, 4, width)
    return planes.transpose(0, 2, 1), at


def _expand_runs(data: Bytes, starts: Index) -> Bytes:
    """The bytes that runs stand for; starts : (n,) where each begins in the data."""
    code = data[starts]
    count = np.array(_COUNT)[code]
    if not count.all():
        raise ValueError("a run is empty")
    first = np.repeat(starts + 1, count)
    within = np.arange(len(first)) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(data[first + within * np.repeat(code <= _MAX_LITERAL, count)])


def _decode_flat(data: bytes, at: int, height: int, width: int) -> tuple[Bytes, int]:
    pixels = np.frombuffer(data, np.uint8, height * width * 4, at).reshape(height, width, 4)
    # (1, 1, 1, n) repeats a pixel in files from before 1991; no program of today writes it.
    if np.any(np.all(pixels[..., :3] == 1, axis=-1)):
        raise ValueError("its pixels are in the old run-length code")
    return pixels, at + pixels.size
