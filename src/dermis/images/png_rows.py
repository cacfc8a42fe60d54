"""Pixels of PNG files whose rows are differences from the one above, as this package writes them."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.images.sizes import check_size

PNG_START = b"\x89PNG\r\n\x1a\n"
_UP = 2
_CHANNELS = {0: 1, 2: 3, 6: 4}  # by PNG's kinds of colour


def decode_rows(data: bytes) -> NDArray[Any] | None:
    """(H, W, 1, 3 or 4) uint8 or uint16; None for PNG files of other forms, and for other files.

    data : of which the checksums are tested
    ValueError : it is damaged, or too large
    """
    if not data.startswith(PNG_START) or len(data) < 33:
        return None
    width, height, bits, colour, *how = struct.unpack_from(">IIBBBBB", data, 16)
    if bits not in (8, 16) or colour not in _CHANNELS or how != [0, 0, 0]:
        return None
    check_size(width, height)
    channels = _CHANNELS[colour]
    step = 1 + width * channels * bits // 8
    packed = _packed(data)
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
    if (rows[:, 0] != _UP).any():
        return None
    pixels = np.add.accumulate(rows[:, 1:], axis=0, dtype=np.uint8)
    levels = pixels.view(">u2").astype(np.uint16) if bits == 16 else pixels
    return levels.reshape(height, width, channels)


def _packed(data: bytes) -> bytes | None:
    """The compressed pixels; None where other parts that change them are there."""
    packed = list[memoryview]()
    for kind, part in png_parts(data):
        if kind == b"tRNS":
            return None
        if kind == b"IDAT":
            packed.append(part)
    return b"".join(packed)


def png_parts(data: bytes) -> Iterator[tuple[bytes, memoryview]]:
    """Kind and content of each part of a PNG file up to its end, by their checksums.

    ValueError : it is cut off or damaged
    """
    view, place, kind = memoryview(data), len(PNG_START), b""
    while kind != b"IEND":
        if place + 12 > len(data):
            raise ValueError("it is cut off")
        (length,), kind = struct.unpack_from(">I", data, place), data[place + 4 : place + 8]
        end = place + 8 + length
        if data[end : end + 4] != struct.pack(">I", zlib.crc32(view[place + 4 : end])):
            raise ValueError(f"its part {kind!r} is damaged")
        yield kind, view[place + 8 : end]
        place = end + 4
