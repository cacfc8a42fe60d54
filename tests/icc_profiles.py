"""ICC profiles for pictures, made from primaries and curves or from tables of CIELAB."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
D50 = (0.9642, 1.0, 0.8249)
DISPLAY_P3 = ((0.51512, 0.2412, -0.00105), (0.29198, 0.69225, 0.04189), (0.1571, 0.06657, 0.78407))
ADOBE_RGB = ((0.60974, 0.31111, 0.01947), (0.20528, 0.62567, 0.06087), (0.14919, 0.06322, 0.74457))
PROPHOTO = ((0.79767, 0.28804, 0.0), (0.13519, 0.71188, 0.0), (0.03134, 0.00009, 0.82491))
SRGB_COLUMNS = ((0.43607, 0.22249, 0.01392), (0.38515, 0.71687, 0.09708), (0.14307, 0.06061, 0.7141))
"""CIE XYZ of red, green and blue under D50."""
SRGB_CURVE = (3, (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045))
"""Kind and numbers of a parametric curve."""


def _fixed(*values: float) -> bytes:
    return struct.pack(f">{len(values)}i", *(round(65536 * value) for value in values))


def _profile(kind: bytes, name: str, tags: dict[bytes, bytes], device: bytes = b"mntr") -> bytes:
    text = name.encode() + b"\0"
    tags = {
        b"desc": b"desc\0\0\0\0" + struct.pack(">I", len(text)) + text + bytes(78),
        b"cprt": b"text\0\0\0\0none\0",
        b"wtpt": b"XYZ \0\0\0\0" + _fixed(*D50),
    } | tags
    offset, table, body = 128 + 4 + 12 * len(tags), b"", b""
    for tag, data in tags.items():
        padded = data + bytes(-len(data) % 4)
        table += tag + struct.pack(">II", offset + len(body), len(data))
        body += padded
    connection = b"Lab " if b"A2B0" in tags else b"XYZ "
    header = bytes(8) + struct.pack(">I", 0x02400000) + device + kind + connection + bytes(12) + b"acsp"
    header += bytes(128 - len(header) - 60) + _fixed(*D50) + bytes(48)
    size = 128 + 4 + len(table) + len(body)
    return struct.pack(">I", size) + header[4:] + struct.pack(">I", len(tags)) + table + body


def _curve(curve: float | Sequence[int] | tuple[int, tuple[float, ...]]) -> bytes:
    if isinstance(curve, float):
        return b"curv\0\0\0\0" + struct.pack(">IH", 1, round(256 * curve))
    if isinstance(curve[1], tuple):
        return b"para\0\0\0\0" + struct.pack(">HH", curve[0], 0) + _fixed(*curve[1])
    return b"curv\0\0\0\0" + struct.pack(f">I{len(curve)}H", len(curve), *curve)


def rgb_profile(name: str, columns: Sequence[Sequence[float]], curve: object) -> bytes:
    """Return a profile of primaries and curves.

    columns : CIE XYZ of red, green and blue under D50
    curve : gamma, levels of 16 bits, or kind and numbers of a parametric curve
    """
    tags = {
        b"%cXYZ" % c: b"XYZ \0\0\0\0" + _fixed(*column) for c, column in zip(b"rgb", columns, strict=True)
    }
    curves = {b"%cTRC" % c: _curve(curve) for c in b"rgb"}  # type: ignore[arg-type]
    return _profile(b"RGB ", name, tags | curves)


def grey_profile(name: str, gamma: float) -> bytes:
    """Return a profile of a grey curve."""
    return _profile(b"GRAY", name, {b"kTRC": _curve(gamma)})


def table_profile(kind: bytes, name: str, to_lab: Callable[[Doubles], Doubles]) -> bytes:
    """Return a profile of a table with two nodes per channel.

    kind : b"CMYK" or b"RGB "
    to_lab : function of channels (n, 3 or 4), 0 to 1, that returns CIELAB (n, 3)
    """
    channels = 4 if kind == b"CMYK" else 3
    lab = to_lab(np.array(list(product((0.0, 1.0), repeat=channels))))
    coded = np.rint(np.clip(lab * (2.55, 1.0, 1.0) + (0.0, 128.0, 128.0), 0, 255)).astype(np.uint8)
    identity = bytes(range(256))
    table = b"mft1\0\0\0\0" + bytes((channels, 3, 2, 0)) + _fixed(1, 0, 0, 0, 1, 0, 0, 0, 1)
    table += identity * channels + coded.tobytes() + identity * 3
    return _profile(kind, name, {b"A2B0": table}, b"prtr")


def ink_lab(inks: Doubles) -> Doubles:
    """Return CIELAB of paper with yellowish white under cyan, magenta, yellow and black ink."""
    c, m, y, k = inks.T
    left = 1.0 - k
    lightness = 95.0 * left * (1.0 - 0.3 * c - 0.4 * m - 0.05 * y)
    return np.stack([lightness, left * (-35.0 * c + 70.0 * m), left * (4.0 - 50.0 * c + 85.0 * y)], axis=-1)


def encoded(pixels: NDArray[np.generic], kind: str, mode: str | None = None, **options: object) -> bytes:
    """Return a picture file that Pillow writes."""
    from PIL import Image

    file = io.BytesIO()
    picture = (
        Image.fromarray(pixels)
        if mode is None
        else Image.frombytes(mode, pixels.shape[1::-1], pixels.tobytes())
    )
    picture.save(file, kind, **options)
    return file.getvalue()


def with_png_chunk(data: bytes, kind: bytes, content: bytes) -> bytes:
    """Return a PNG file with another chunk after its header."""
    chunk = struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
    return data[:33] + chunk + data[33:]


def with_png_profile(data: bytes, profile: bytes) -> bytes:
    """Return a PNG file with an ICC profile."""
    return with_png_chunk(data, b"iCCP", b"profile\0\0" + zlib.compress(profile))
