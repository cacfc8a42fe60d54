"""Reading of Radiance pictures (.hdr): RGBE pixels, run-length coded by scanline."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

RADIANCE_START = b"#?"


def decode_radiance(data: bytes) -> NDArray[np.float32]:
    """Linear radiance (H, W, 3) of the bytes of a .hdr file, divided by its EXPOSURE.

    data : the whole file, in the top-down left-to-right order that programs write
    ValueError : the data are cut off, damaged, or in another order or colour space

    Ours rather than FFmpeg's, which passes over a file that lacks its last bytes.
    """
    height, width, exposure, start = _header(data)
    if height * width > 16384**2:
        raise ValueError(f"it has {width} x {height} pixels")
    rgbe = _scanlines(data, start, height, width)
    # A mantissa byte counts 1/256 of 2^(E - 128); E = 0 means black, which 2^-136 rounds to anyhow.
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
