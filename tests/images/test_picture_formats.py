"""Pictures in all formats of phones, cameras and programs; properties that are not used are noted."""

from __future__ import annotations

import base64
import io
import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from heic_photograph import TURNED_HEIC
from icc_profiles import encoded, ink_lab, table_profile
from numpy.typing import NDArray

from dermis.base.errors import DermisError, DermisWarning
from dermis.images.colour_spaces import coded_colour_space
from dermis.images.io import EmbeddedPicture, read_colours, read_image, read_size
from dermis.images.opening import picture_format

Bytes = NDArray[np.uint8]
DEEP_AVIF = base64.b64decode(
    """
AAAAIGZ0eXBhdmlmAAAAAGF2aWZtaWYxbWlhZk1BMUIAAAD5bWV0YQAAAAAAAAAvaGRscgAAAAAAAAAAcGljdAAAAAAAAAAAAAAA
AFBpY3R1cmVIYW5kbGVyAAAAAA5waXRtAAAAAAABAAAAHmlsb2MAAAAARAAAAQABAAAAAQAAASEAAAAdAAAAKGlpbmYAAAAAAAEA
AAAaaW5mZQIAAAAAAQAAYXYwMUNvbG9yAAAAAGppcHJwAAAAS2lwY28AAAAUaXNwZQAAAAAAAABAAAAAQAAAABBwaXhpAAAAAAMK
CgoAAAAMYXYxQ4EATAAAAAATY29scm5jbHgAAgACAAIAAAAAF2lwbWEAAAAAAAAAAQABBAECgwQAAAAlbWRhdAoKAAAAAq//jV84
CDIPEAC6AgssUUEAAAgH7k4w
"""
)
"""64 x 64 pixels of grey 120 with 10 bits a channel."""


@pytest.fixture
def blocks() -> Bytes:
    """Return three large areas of colour, which are little changed by lossy formats."""
    pixels = np.zeros((32, 48, 3), np.uint8)
    pixels[:16], pixels[16:] = (200, 120, 90), (60, 90, 160)
    pixels[:, :12] = (30, 160, 60)
    return pixels


def written(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


@pytest.mark.parametrize(("kind", "lossless"), [("WEBP", True), ("WEBP", False), ("AVIF", False)])
def test_webp_and_avif_are_read_whatever_their_name(
    tmp_path: Path, blocks: Bytes, kind: str, lossless: bool
) -> None:
    data = encoded(blocks, kind, lossless=True) if lossless else encoded(blocks, kind, quality=95)
    assert picture_format(data) == kind
    path = written(tmp_path / "a.png", data)
    assert read_size(path) == (48, 32)
    for source in (path, EmbeddedPicture("head.glb, image 0", data)):
        difference = np.abs(read_image(source).astype(int) - blocks)
        assert np.median(difference) <= 2 and (not lossless or difference.max() == 0)


def test_webp_keeps_its_alpha(tmp_path: Path, blocks: Bytes) -> None:
    levels = np.dstack([blocks, np.full(blocks.shape[:2], 99, np.uint8)])
    np.testing.assert_array_equal(
        read_image(written(tmp_path / "a.webp", encoded(levels, "WEBP", lossless=True))), levels
    )


@pytest.mark.parametrize("kind", ["WEBP", "AVIF"])
def test_format_missing_in_pillow_is_named(
    tmp_path: Path, blocks: Bytes, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from PIL import features

    path = written(tmp_path / "a.png", encoded(blocks, kind))
    monkeypatch.setattr(features, "check", lambda name: False)
    with pytest.raises(DermisError, match=rf"a\.png: a picture in {kind}: expected Pillow .*pip install"):
        read_image(path)


@pytest.mark.parametrize("kind", ["WEBP", "AVIF"])
def test_the_size_is_judged_before_pixels_are_decoded(
    tmp_path: Path, blocks: Bytes, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from PIL import ImageFile

    from dermis.images import sizes

    path = written(tmp_path / "a.png", encoded(blocks, kind))
    monkeypatch.setattr(sizes, "MAX_PIXELS", 1000)
    monkeypatch.setattr(ImageFile.ImageFile, "load", lambda self: pytest.fail("it was decoded"))
    for read in (read_image, read_size):
        with pytest.raises(DermisError, match=r"a\.png: expected .* 8192 x 8192 pixels, but it has 48 x 32"):
            read(path)


def test_heic_is_read_upright(tmp_path: Path, blocks: Bytes) -> None:
    pytest.importorskip("pi_heif")
    path = written(tmp_path / "a.jpg", TURNED_HEIC)
    with pytest.warns(DermisWarning, match=r"a\.jpg: it is turned upright as its EXIF says"):
        pixels = read_image(path)
    assert read_size(path) == (32, 48)
    assert np.median(np.abs(pixels.astype(int) - np.rot90(blocks, -1))) <= 2


def test_heic_without_its_package_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pi_heif", None)
    path = written(tmp_path / "a.heic", TURNED_HEIC)
    with pytest.raises(DermisError, match=r"a\.heic: a HEIC picture: .* pi-heif, .*dermis\[formats\]"):
        read_image(path)


def test_cmyk_without_a_profile_is_converted_with_a_note(tmp_path: Path) -> None:
    inks = np.broadcast_to(np.uint8([0, 128, 255, 0]), (16, 16, 4))
    for name, kind in (("a.tif", "TIFF"), ("a.jpg", "JPEG")):
        path = written(tmp_path / name, encoded(inks, kind, "CMYK"))
        with pytest.warns(DermisWarning, match=rf"{name}: its CMYK is converted to sRGB without a profile"):
            pixels = read_image(path)
        assert np.abs(pixels.astype(int) - (255, 127, 0)).max() <= 3


def test_cmyk_is_converted_by_its_profile(tmp_path: Path) -> None:
    inks = np.broadcast_to(np.uint8([255, 0, 0, 0]), (16, 16, 4))
    profile = table_profile(b"CMYK", "Newsprint", ink_lab)
    path = written(tmp_path / "a.tif", encoded(inks, "TIFF", "CMYK", icc_profile=profile))
    with pytest.warns(
        DermisWarning, match=r"a\.tif: its CMYK is converted to sRGB by its profile, Newsprint$"
    ):
        pixels, space = read_colours(path)
    assert space.is_default
    # CIELAB relative to the white of the paper, before the compensation of black; else (0, 255, 255)
    assert np.abs(pixels.astype(int) - (0, 193, 255)).max() <= 12


def tiff(photometric: int, pixels: NDArray[np.uint16], gap: bytes = b"") -> bytes:
    """Return a TIFF file of 16 bits, which Pillow does not write.

    gap : bytes between its first eight bytes and its directory
    """
    rows, columns, samples = pixels.shape
    values = {256: columns, 257: rows, 258: 0, 259: 1, 262: photometric, 273: 0, 277: samples, 278: rows}
    start = 8 + len(gap)
    end = start + 2 + 12 * (len(values) + 1) + 4
    values |= {258: end, 273: end + 2 * samples, 279: pixels.nbytes}
    entries = [struct.pack("<HHII", tag, 4, 1, value) for tag, value in values.items()]
    entries[2] = struct.pack("<HHII", 258, 3, samples, end)
    head = b"II*\0" + struct.pack("<I", start) + gap + struct.pack("<H", len(entries)) + b"".join(entries)
    return head + bytes(4) + struct.pack(f"<{samples}H", *[16] * samples) + pixels.astype("<u2").tobytes()


def test_cmyk_of_16_bits_is_not_read_as_rgba(tmp_path: Path) -> None:
    inks = np.broadcast_to(np.uint16([0, 32768, 65535, 0]), (8, 8, 4))
    with pytest.warns(DermisWarning, match="without a profile.*; its 16 bits a channel are reduced to 8"):
        pixels = read_image(written(tmp_path / "a.tif", tiff(5, inks)))
    assert np.abs(pixels.astype(int) - (255, 127, 0)).max() <= 1


def test_only_the_first_of_several_pictures_is_read(tmp_path: Path, blocks: Bytes) -> None:
    from PIL import Image

    first, second = Image.fromarray(blocks), Image.fromarray(blocks[::-1].copy())
    for name, kind in (("a.webp", "WEBP"), ("a.png", "PNG"), ("a.tif", "TIFF"), ("a.jpg", "MPO")):
        options = {"lossless": True} if kind == "WEBP" else {}
        first.save(tmp_path / name, kind, save_all=True, append_images=[second], **options)
        with pytest.warns(DermisWarning, match=rf"{name}: it has several pictures, and only the first"):
            pixels = read_image(tmp_path / name)
        assert np.median(np.abs(pixels[..., :3].astype(int) - blocks)) <= 2


def test_preview_of_a_camera_raw_file_is_not_used(tmp_path: Path, blocks: Bytes) -> None:
    from PIL.TiffImagePlugin import ImageFileDirectory_v2

    data = tiff(2, np.zeros((8, 8, 3), np.uint16), b"CR\2\0\0\0\0\0")
    with pytest.raises(DermisError, match=r"a\.cr2: .*raw file"):
        read_image(written(tmp_path / "a.cr2", data))
    for tag, value in ((50706, b"\1\4\0\0"), (254, 1)):
        tags = ImageFileDirectory_v2()
        tags[tag] = value
        path = written(tmp_path / "a.dng", encoded(blocks, "TIFF", tiffinfo=tags))
        with pytest.raises(DermisError, match=r"a\.dng: .*raw file.* Convert it"):
            read_image(path)


@pytest.mark.parametrize(
    ("start", "name"),
    [
        (b"GIF89a", "GIF"),
        (b"BM", "BMP"),
        (b"8BPS", "Photoshop"),
        (b"\xabKTX 20\xbb", "KTX"),
        (b"\xff\x0a", "XL"),
    ],
)
def test_unsupported_formats_are_named(tmp_path: Path, start: bytes, name: str) -> None:
    with pytest.raises(DermisError, match=rf"a\.png: expected .* but it is .*{name}.* Convert it to PNG"):
        read_image(written(tmp_path / "a.png", start + bytes(64)))


def test_unsupported_pixel_types_are_named(tmp_path: Path) -> None:
    from PIL import Image

    Image.new("LAB", (16, 16)).save(tmp_path / "a.tif")
    with pytest.raises(DermisError, match=r"a\.tif: expected .* but its pixels are of kind LAB\. Convert it"):
        read_image(tmp_path / "a.tif")


@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_rotation_applies_to_photographs_only(tmp_path: Path, blocks: Bytes, orientation: int) -> None:
    from PIL import Image, ImageOps

    exif = Image.Exif()
    exif[0x112] = orientation
    data = encoded(blocks, "PNG", exif=exif)
    path = written(tmp_path / "a.png", data)
    expected = np.asarray(ImageOps.exif_transpose(Image.open(io.BytesIO(data))))
    if orientation == 1:
        np.testing.assert_array_equal(read_colours(path, apply_exif_orientation=True)[0], expected)
        return
    with pytest.warns(DermisWarning, match=r"a\.png: it is turned upright as its EXIF says"):
        np.testing.assert_array_equal(read_colours(path, apply_exif_orientation=True)[0], expected)
    with pytest.warns(DermisWarning, match=r"a\.png: it is not turned as its EXIF says"):
        np.testing.assert_array_equal(read_image(path), blocks)


def test_levels_for_hdr_displays_are_refused(tmp_path: Path, blocks: Bytes) -> None:
    data = encoded(blocks, "AVIF")
    start = data.index(b"colrnclx") + 8
    coded = data[:start] + struct.pack(">HH", 9, 16) + data[start + 4 :]
    with pytest.raises(DermisError, match=r"a\.avif: .*HDR displays \(PQ\)"):
        read_image(written(tmp_path / "a.avif", coded))
    assert coded_colour_space(77, 13) is None


def test_avif_of_10_bits_is_reduced_with_a_note(tmp_path: Path) -> None:
    path = written(tmp_path / "a.avif", DEEP_AVIF)
    with pytest.warns(DermisWarning, match=r"a\.avif: its 10 bits a channel are reduced to 8"):
        assert np.abs(read_image(path).astype(int) - 120).max() <= 2
