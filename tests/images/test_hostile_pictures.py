"""Pictures with misleading headers are refused, or decoded in little memory."""

from __future__ import annotations

import io
import struct
import subprocess
import sys
import zlib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from dermis.base.errors import DermisError
from dermis.formats.maps import load_maps
from dermis.images.io import read_image

MAP_SIDE = 4096
MAX_MEMORY = 3.0  # times the size of the pixels


def png(width: int, height: int, bits: int, kind: int, rows: bytes) -> bytes:
    def part(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    palette = part(b"PLTE", bytes(range(256)) * 3) if kind == 3 else b""
    pixels = part(b"IDAT", zlib.compress(rows, 1))
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", header) + palette + pixels + part(b"IEND", b"")


def radiance(width: int, height: int, rows: bytes) -> bytes:
    return f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode() + rows


def jpeg(scans: int) -> bytes:
    """Return a JPEG twice as high as wide with so many scans, all but the first empty."""
    import PIL.Image

    stream = io.BytesIO()
    PIL.Image.new("RGB", (4096, 8192)).save(stream, "JPEG", progressive=True)
    return stream.getvalue().replace(b"\xff\xd9", b"\xff\xda" * scans + b"\xff\xd9")


def exr(folder: Path, width: int, height: int, layers: int = 0) -> bytes:
    """Return a small EXR file whose header has another size."""
    import OpenEXR

    channels = {f"layer {k}": np.ones((4, 4), np.float32) for k in range(layers)}
    channels["RGB"] = np.ones((4, 4, 3), np.float32)
    OpenEXR.File({}, channels).write(str(folder / "small.exr"))
    data = (folder / "small.exr").read_bytes()
    at = data.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    return data[:at] + struct.pack("<4i", 0, 0, width - 1, height - 1) + data[at + 16 :]


@pytest.mark.parametrize("name", ["a.png", "a.hdr", "a.exr", "wide.exr"])
def test_excessive_pixel_counts_are_refused_from_the_header(tmp_path: Path, name: str) -> None:
    files = {
        "a.png": png(16384, 16384, 8, 2, b""),
        "a.hdr": radiance(16384, 8192, b"\2\2\x40\0"),
        "a.exr": exr(tmp_path, 16384, 8192),
        "wide.exr": exr(tmp_path, 1 << 28, 1),
    }
    (tmp_path / name).write_bytes(files[name])
    with pytest.raises(DermisError, match=rf"{name}: expected a picture of at most 8192 x 8192 pixels"):
        read_image(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("none.hdr", radiance(0, 0, b""), "0 x 0"),
        ("lit.hdr", b"#?RADIANCE\nEXPOSURE=0" + radiance(8, 1, bytes(32))[10:], "EXPOSURE"),
        ("dark.hdr", b"#?RADIANCE\nEXPOSURE=nan" + radiance(8, 1, bytes(32))[10:], "EXPOSURE"),
        ("empty.hdr", radiance(8, 1, b"\2\2\0\10" + b"\0" * 64), "run is empty|is truncated"),
        ("scans.jpg", jpeg(100), "scans"),
    ],
)
def test_invalid_headers_are_refused(tmp_path: Path, name: str, data: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(DermisError, match=rf"{name}: .*({words})"):
        read_image(tmp_path / name)


def test_exr_layers_count_towards_the_limit(tmp_path: Path) -> None:
    """The library decodes all layers, including unused ones."""
    (tmp_path / "a.exr").write_bytes(exr(tmp_path, 2048, 1024, layers=94))
    with pytest.raises(DermisError, match=r"a\.exr: .*all its channels have 203 million numbers"):
        read_image(tmp_path / "a.exr")


def peak_of(path: Path, call: str) -> float:
    """Return the peak memory of a child process that makes a call, relative to the size of its result."""
    code = f"""
import resource, sys
from dermis.images import codecs, colour, hdr
from dermis.images.io import read_image
from dermis.formats.maps import load_maps
import OpenEXR, PIL.Image, PIL.PngImagePlugin
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
pixels = {call}
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 / pixels.nbytes)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=path)
    return float(done.stdout)


@pytest.mark.parametrize(
    ("kind", "row", "call"),
    [
        (3, b"\5", "read_image('a.png')"),
        (2, b"\x80\x80\xff", "load_maps(normal='a.png').normal"),
        (0, b"\5", "load_maps(height='a.png', height_mm=0.02).height"),
    ],
    ids=["palette", "normals", "heights"],
)
def test_decoding_needs_little_extra_memory(tmp_path: Path, kind: int, row: bytes, call: str) -> None:
    rows = (b"\0" + row * MAP_SIDE) * MAP_SIDE
    (tmp_path / "a.png").write_bytes(png(MAP_SIDE, MAP_SIDE, 8, kind, rows))
    assert peak_of(tmp_path, call) < MAX_MEMORY


def test_run_length_decoding_is_linear_in_time(tmp_path: Path) -> None:
    """Runs of two pixels alternate with two literal pixels."""
    width, height = 4096, 32
    row = b"\2\2" + struct.pack(">H", width) + b"\x82\x82\2\1\3" * width
    (tmp_path / "a.hdr").write_bytes(radiance(width, height, row * height))
    calls: Counter[str] = Counter()
    sys.setprofile(lambda frame, event, given: calls.update([event]))
    try:
        image = read_image(tmp_path / "a.hdr")
    finally:
        sys.setprofile(None)
    assert calls["call"] + calls["c_call"] < 1.1 * (2 * width * height)
    level = np.array([130, 130, 1, 3])
    expected = (level * 2.0 ** (level - 136)).astype(np.float32)
    np.testing.assert_array_equal(image[-1, 4:8], np.repeat(expected[:, None], 3, axis=1))


def test_infinite_heights_are_refused_after_they_are_scaled(tmp_path: Path) -> None:
    import PIL.Image

    PIL.Image.fromarray(np.full((16, 16), 3e38, np.float32)).save(tmp_path / "a.tif")
    with pytest.raises(DermisError, match=r"a\.tif: expected a map of finite numbers"):
        load_maps(height=tmp_path / "a.tif", height_mm=0.02)


def test_map_size_is_limited_to_device_textures(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(png(8193, 16, 8, 2, b""))
    with pytest.raises(DermisError, match=r"a\.png: expected a colour map of at most 8192 texels a side"):
        load_maps(colour=tmp_path / "a.png")
