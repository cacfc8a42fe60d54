"""Changes to headers of pictures that keep everything else valid, including checksums."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable
from random import Random

from adversity.hostile import number, whole
from adversity.raw import changed_bytes

_PNG_START = 8
_JPEG_SIZE = re.compile(rb"\xff[\xc0\xc2]..", re.DOTALL)
_EXR_FIELD = re.compile(rb"(dataWindow|displayWindow)\0box2i\0\x10\0\0\0", re.DOTALL)
_HDR_SIZE = re.compile(rb"-Y (\d+) \+X (\d+)")
_SHORT, _LONG = 3, 4  # TIFF's kinds of numbers


def changed_header(data: bytes, rng: Random) -> bytes:
    """Return the picture with another size, depth or type in its header; change bytes if there is none."""
    for start, change in _KINDS.items():
        if data.startswith(start):
            return change(bytearray(data), rng)
    return changed_bytes(data, rng)


def _png(data: bytearray, rng: Random) -> bytes:
    """Change a field of one of the first chunks, or repeat the chunk, with the right checksum."""
    parts, place = [], _PNG_START
    while place + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, place)
        parts.append((place, length))
        place += 12 + length
    place, length = rng.choice(parts[:4])
    body = bytearray(data[place + 4 : place + 8 + length])
    if length:
        size = min(rng.choice((1, 1, 4)), length)
        at = 4 + rng.randrange(min(length, 16) - size + 1)
        body[at : at + size] = whole(rng, size).to_bytes(size, "big")
    part = struct.pack(">I", length) + body + struct.pack(">I", zlib.crc32(body))
    return bytes(data[:place] + part * rng.choice((1, 1, 1, 2, 1000)) + data[place + 12 + length :])


def _tiff(data: bytearray, rng: Random) -> bytes:
    """Change type, count or value of an entry of the directory."""
    order = "<" if data[:2] == b"II" else ">"
    (place,) = struct.unpack_from(order + "I", data, 4)
    (count,) = struct.unpack_from(order + "H", data, place)
    at = place + 2 + 12 * rng.randrange(max(count, 1))
    field, form = rng.choice(((2, "H"), (4, "I"), (8, "I"), (8, "H")))
    struct.pack_into(order + form, data, at + field, whole(rng, struct.calcsize(form)))
    if field == 2:
        struct.pack_into(order + "H", data, at + field, rng.randrange(20))
    return bytes(data)


def _jpeg(data: bytearray, rng: Random) -> bytes:
    found = _JPEG_SIZE.search(data)
    if found:
        at = found.end() + rng.choice((0, 1, 3, 5))  # depth, height, width, channels
        size = 2 if at - found.end() in (1, 3) else 1
        data[at : at + size] = whole(rng, size).to_bytes(size, "big")
    return bytes(data)


def _exr(data: bytearray, rng: Random) -> bytes:
    found = list(_EXR_FIELD.finditer(data))
    if found and rng.random() < 0.7:
        at = rng.choice(found).end() + 4 * rng.randrange(4)
        data[at : at + 4] = whole(rng, 4).to_bytes(4, "little")
        return bytes(data)
    return changed_bytes(bytes(data[:600]), rng) + bytes(data[600:])


def _hdr(data: bytearray, rng: Random) -> bytes:
    found = _HDR_SIZE.search(data)
    if not found:
        return changed_bytes(bytes(data), rng)
    which = rng.choice((1, 2))
    told = number(rng).encode()
    if rng.random() < 0.3:
        return bytes(data[: found.start()] + b"EXPOSURE=" + told + b"\n" + data[found.start() :])
    return bytes(data[: found.start(which)] + told + data[found.end(which) :])


_KINDS: dict[bytes, Callable[[bytearray, Random], bytes]] = {
    b"\x89PNG": _png,
    b"II": _tiff,
    b"MM": _tiff,
    b"\xff\xd8": _jpeg,
    b"\x76\x2f\x31\x01": _exr,
    b"#?": _hdr,
}
