"""Radiance pictures (.hdr): shared exponents, run-length coded."""

from __future__ import annotations

import re
from math import prod

import numpy as np
from numpy.typing import NDArray

from dermis.images.sizes import check_size

Bytes = NDArray[np.uint8]

RADIANCE_START = b"#?"
_MOST_HEADER = 1 << 16
_STRIP = 1 << 18  # pixels decoded at a time
_LONGEST = 128  # bytes that are not repeated; a larger number is that of a run
_COUNT = [k if k <= _LONGEST else k - _LONGEST for k in range(256)]
_STEP = [k + 1 if k <= _LONGEST else 2 for k in range(256)]


def decode_radiance(data: bytes) -> NDArray[np.float32]:
    """Linear radiance (H, W, 3) of the bytes of a .hdr file, divided by its EXPOSURE.

    data : the whole file, in the top-down left-to-right order that programs write
    ValueError : the data are cut off, damaged, or in another order or colour space

    Ours rather than FFmpeg's, which accepts a file that lacks its last bytes.
    """
    height, width, exposure, at = _header(data)
    coded = data[at : at + 4] == _mark(width) and 8 <= width < 32768
    if len(data) - at < height * (4 if coded else 4 * width):
        raise ValueError("it ends in the middle")
    radiance = np.empty((height, width, 3), np.float32)
    rows = max(1, _STRIP // width)
    for top in range(0, height, rows):
        strip = radiance[top : top + rows]
        rgbe, at = (_coded if coded else _plain)(data, at, len(strip), width)
        # A mantissa byte counts 1/256 of 2^(E - 128); E = 0 means black, and 2^-136 is black in any case.
        scale = np.ldexp(np.float32(1 / exposure), rgbe[..., 3].astype(np.int32) - 136)
        np.multiply(rgbe[..., :3], scale[..., None], out=strip)
    return radiance


def radiance_size(data: bytes) -> tuple[int, int]:
    """Width and height of a .hdr file by its header."""
    height, width, _, _ = _header(data)
    return width, height


def _header(data: bytes) -> tuple[int, int, float, int]:
    """(height, width, exposure, where the pixels begin)."""
    found = re.search(rb"\n\n-Y (\d{1,9}) \+X (\d{1,9})\n", data[:_MOST_HEADER])
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


def _mark(width: int) -> bytes:
    """What a coded scanline begins with."""
    return bytes((2, 2, width >> 8 & 255, width & 255))


def _coded(data: bytes, at: int, height: int, width: int) -> tuple[Bytes, int]:
    """(H, W, 4) bytes of scanlines, and where the next begins: runs are found one by one, filled at once."""
    starts: list[int] = []
    mark, add = _mark(width), starts.append
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
    planes = _filled(np.frombuffer(data, np.uint8), np.array(starts)).reshape(height, 4, width)
    return planes.transpose(0, 2, 1), at


def _filled(data: Bytes, starts: NDArray[np.int64]) -> Bytes:
    """The bytes that runs stand for; starts : (n,) where each begins in the data."""
    code = data[starts]
    count = np.array(_COUNT)[code]
    if not count.all():
        raise ValueError("a run is empty")
    first = np.repeat(starts + 1, count)
    within = np.arange(len(first)) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(data[first + within * np.repeat(code <= _LONGEST, count)])


def _plain(data: bytes, at: int, height: int, width: int) -> tuple[Bytes, int]:
    pixels = np.frombuffer(data, np.uint8, height * width * 4, at).reshape(height, width, 4)
    # (1, 1, 1, n) repeats a pixel in files from before 1991; no program of today writes it.
    if np.any(np.all(pixels[..., :3] == 1, axis=-1)):
        raise ValueError("its pixels are in the old run-length code")
    return pixels, at + pixels.size
