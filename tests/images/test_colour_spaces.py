"""Colours are converted to linear Rec. 709 by profiles, code points, EXIF and primaries, at full depth."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from icc_profiles import (
    ADOBE_RGB,
    DISPLAY_P3,
    PROPHOTO,
    SRGB_COLUMNS,
    SRGB_CURVE,
    encoded,
    grey_profile,
    rgb_profile,
    table_profile,
    with_png_chunk,
    with_png_profile,
)
from numpy.typing import NDArray

from dermis.base.errors import DermisWarning
from dermis.formats.maps import load_maps
from dermis.images.codecs import encode_png
from dermis.images.colour import decode_srgb, encode_srgb, encode_srgb8
from dermis.images.colour_spaces import (
    adobe_rgb,
    coded_colour_space,
    gamma_colour_space,
    profile_colour_space,
)
from dermis.images.io import EmbeddedPicture, read_colours, read_image

Levels = NDArray[Any]
ADOBE_GAMMA = 563 / 256


@pytest.fixture
def levels() -> Levels:
    return np.random.default_rng(5).integers(0, 256, (24, 32, 3)).astype(np.uint8)


def linear(path: Path) -> NDArray[np.float32]:
    pixels, space = read_colours(path)
    return space.to_linear(pixels)


def by_littlecms(levels: Levels, profile: bytes) -> Levels:
    from PIL import Image, ImageCms

    source, target = ImageCms.ImageCmsProfile(io.BytesIO(profile)), ImageCms.createProfile("sRGB")
    transform = ImageCms.buildTransform(source, target, "RGB", "RGB", ImageCms.Intent.RELATIVE_COLORIMETRIC)
    return np.asarray(transform.apply(Image.fromarray(levels)))


@pytest.mark.parametrize(
    ("name", "columns", "curve"),
    [
        ("Display P3", DISPLAY_P3, SRGB_CURVE),
        ("Adobe RGB (1998)", ADOBE_RGB, ADOBE_GAMMA),
        ("ProPhoto", PROPHOTO, 1.8),
        ("Linear", SRGB_COLUMNS, 1.0),
        ("Table", ADOBE_RGB, [0, 900, 9000, 65535]),
        ("Gamma in words", DISPLAY_P3, (0, (2.0,))),
        ("Toe", ADOBE_RGB, (2, (2.2, 0.9, 0.05, 0.01))),
    ],
)
def test_profiles_convert_as_littlecms_does(
    tmp_path: Path, levels: Levels, name: str, columns: Any, curve: Any
) -> None:
    profile = rgb_profile(name, columns, curve)
    for kind in ("PNG", "TIFF", "WEBP"):
        options = {"lossless": True} if kind == "WEBP" else {}
        path = tmp_path / f"a.{kind.lower()}"
        path.write_bytes(encoded(levels, kind, icc_profile=profile, **options))
        with pytest.warns(DermisWarning, match="its colours are converted from .* to sRGB") as notes:
            converted = encode_srgb8(linear(path)).astype(int)
        assert f"from {name} to" in str(notes[0].message)
        assert np.abs(converted - by_littlecms(levels, profile)).max() <= 1


def test_an_srgb_profile_changes_nothing_and_is_not_noted(tmp_path: Path, levels: Levels) -> None:
    from PIL import ImageCms

    own = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    for profile in (own, rgb_profile("sRGB", SRGB_COLUMNS, SRGB_CURVE)):
        path = tmp_path / "a.png"
        path.write_bytes(encoded(levels, "PNG", icc_profile=profile))
        pixels, space = read_colours(path)
        assert space.is_default
        np.testing.assert_array_equal(pixels, levels)


def test_16_bits_with_a_profile_keep_their_depth(tmp_path: Path) -> None:
    """Check that levels between those of 8 bits differ after a conversion."""
    deep = np.arange(3 * 64, dtype=np.uint16).reshape(8, 8, 3) + 5000
    path = tmp_path / "a.png"
    path.write_bytes(with_png_profile(encode_png(deep), rgb_profile("Wide", PROPHOTO, 1.8)))
    with pytest.warns(DermisWarning, match="from Wide to sRGB$"):
        colours = load_maps(colour=path).colour
    assert colours is not None and len(np.unique(colours[..., 1])) == 64
    expected = profile_colour_space(rgb_profile("Wide", PROPHOTO, 1.8))
    assert expected is not None
    np.testing.assert_allclose(colours, expected.to_linear(deep), rtol=1e-6)


def test_neutral_stays_neutral_in_every_space(levels: Levels) -> None:
    spaces = [
        adobe_rgb(),
        coded_colour_space(12, 13),
        coded_colour_space(9, 1),
        gamma_colour_space("", None, (1, 0, 0, 1, 0, 0, 1 / 3, 1 / 3)),
    ]
    for space in spaces:
        assert space is not None and not space.is_default
        grey = space.to_linear(np.full((1, 1, 3), 0.5, np.float32))
        np.testing.assert_allclose(grey, 0.5, rtol=2e-4)


def test_known_display_p3_colour_is_converted() -> None:
    """Check P3's red in linear sRGB: (1.2249, -0.0420, -0.0197), as CSS Color 4 converts it."""
    space = coded_colour_space(12, 13)
    assert space is not None and space.to_rec709 is not None
    np.testing.assert_allclose(space.to_rec709[:, 0], (1.2249, -0.0420, -0.0197), atol=2e-4)
    np.testing.assert_array_equal(space.to_linear(np.uint8([[[255, 0, 0]]])), [[[1.0, 0.0, 0.0]]])


def test_grey_with_profile_is_converted(tmp_path: Path, levels: Levels) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(encoded(levels[..., 0], "PNG", icc_profile=grey_profile("Grey 1.8", 1.8)))
    with pytest.warns(DermisWarning, match=r"from Grey 1\.8 to sRGB"):
        found = linear(path)
    np.testing.assert_allclose(found, np.repeat((levels[..., :1] / 255.0) ** 1.8, 3, axis=-1), atol=3e-4)
    path.write_bytes(encoded(levels[..., 0], "PNG"))
    with pytest.warns(DermisWarning, match=r"a\.png: it is grey"):
        found = linear(path)
    np.testing.assert_allclose(found, np.repeat(decode_srgb(levels[..., :1] / 255.0), 3, -1), atol=1e-6)


def test_table_based_profile_is_converted_at_8_bits(tmp_path: Path, levels: Levels) -> None:
    def lab(rgb: NDArray[np.float64]) -> NDArray[np.float64]:
        r, g, b = rgb.T
        return np.stack([100.0 * (0.2 * r + 0.7 * g + 0.1 * b), 60.0 * (r - g), 60.0 * (g - b)], axis=-1)

    profile = table_profile(b"RGB ", "Scanner", lab)
    path = tmp_path / "a.png"
    path.write_bytes(encoded(levels, "PNG", icc_profile=profile))
    with pytest.warns(DermisWarning, match="from Scanner to sRGB, at 8 bits a channel"):
        found = encode_srgb8(linear(path)).astype(int)
    assert np.abs(found - by_littlecms(levels, profile)).mean() < 5 and (found != levels).any()


@pytest.mark.parametrize(
    ("profile", "note"),
    [
        (rgb_profile("Cut", DISPLAY_P3, SRGB_CURVE)[:200], "profile is damaged"),
        (b"nonsense", "profile is damaged"),
        (rgb_profile("Odd", DISPLAY_P3, (7, ())) , "profile is damaged"),
        (grey_profile("Grey", 1.8), "profile, Grey, does not fit its pixels"),
        (table_profile(b"CMYK", "Ink", lambda x: x[:, :3]), "profile, Ink, does not fit its pixels"),
    ],
)  # fmt: skip
def test_profiles_that_cannot_be_used_are_noted(
    tmp_path: Path, levels: Levels, profile: bytes, note: str
) -> None:
    path = tmp_path / "a.jpg"
    path.write_bytes(encoded(levels, "TIFF", icc_profile=profile))
    with pytest.warns(DermisWarning, match=rf"a\.jpg: its colour {note}"):
        pixels, space = read_colours(path)
    assert space.is_default
    np.testing.assert_array_equal(pixels, levels)


def test_profile_names_are_escaped_in_notes(tmp_path: Path, levels: Levels) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(
        encoded(levels, "PNG", icc_profile=rgb_profile("P3\x1b[31m" + 90 * "x", DISPLAY_P3, 2.2))
    )
    with pytest.warns(DermisWarning) as notes:
        read_colours(path)
    assert "\x1b" not in str(notes[0].message) and len(str(notes[0].message)) < len(str(path)) + 120


def test_non_colour_maps_are_not_converted(tmp_path: Path, levels: Levels) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(encoded(levels, "PNG", icc_profile=rgb_profile("P3", DISPLAY_P3, SRGB_CURVE)))
    np.testing.assert_array_equal(read_image(path), levels)


def test_pictures_in_gltf_files_are_srgb_whatever_their_profile(levels: Levels) -> None:
    data = encoded(levels, "PNG", icc_profile=rgb_profile("P3", DISPLAY_P3, SRGB_CURVE))
    with pytest.warns(DermisWarning, match="image 0: its colour profile is not used, as glTF demands"):
        pixels, space = read_colours(EmbeddedPicture("head.glb, image 0", data))
    assert space.is_default
    np.testing.assert_array_equal(pixels, levels)


def test_the_note_of_a_cached_map_is_repeated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path / "cache"))
    noise = np.random.default_rng(6).integers(0, 256, (128, 128, 3)).astype(np.uint8)
    path = tmp_path / "a.png"
    path.write_bytes(encoded(noise, "PNG", icc_profile=rgb_profile("P3", DISPLAY_P3, SRGB_CURVE)))
    maps = []
    for _ in range(2):
        with pytest.warns(DermisWarning, match="from P3 to sRGB"):
            maps.append(load_maps(colour=path).colour)
    assert maps[0] is not None and maps[1] is not None
    np.testing.assert_array_equal(maps[0], maps[1])
    with pytest.warns(DermisWarning, match="as glTF demands"):
        embedded = load_maps(colour=EmbeddedPicture("a.glb, image 0", path.read_bytes())).colour
    assert embedded is not None and not np.array_equal(embedded, maps[0])


def test_cameras_state_adobe_rgb_in_exif(tmp_path: Path, levels: Levels) -> None:
    from PIL import Image

    interoperability, colours = Image.Exif(), Image.Exif()
    interoperability.get_ifd(0x8769)[0xA005] = {1: "R03"}
    colours.get_ifd(0x8769)[0xA001] = 2
    for exif in (interoperability, colours):
        exif[0x10F] = "Maker"  # Pillow does not write EXIF without any
        path = tmp_path / "a.png"
        path.write_bytes(encoded(levels, "PNG", exif=exif))
        with pytest.warns(DermisWarning, match="from Adobe RGB to sRGB"):
            found = linear(path)
        expected = by_littlecms(levels, rgb_profile("", ADOBE_RGB, ADOBE_GAMMA)).astype(int)
        assert np.abs(encode_srgb8(found) - expected).max() <= 1


def test_png_states_gamma_primaries_and_code_points(tmp_path: Path, levels: Levels) -> None:
    path, plain = tmp_path / "a.png", encoded(levels, "PNG")
    path.write_bytes(with_png_chunk(plain, b"gAMA", struct.pack(">I", 100000)))
    with pytest.warns(DermisWarning, match="from gamma 1 to sRGB"):
        np.testing.assert_allclose(linear(path), levels / 255.0, atol=1e-4)
    path.write_bytes(with_png_chunk(plain, b"cICP", bytes((12, 13, 0, 1))))
    with pytest.warns(DermisWarning, match="from Display P3 to sRGB"):
        found = encode_srgb8(linear(path)).astype(int)
    assert np.abs(found - by_littlecms(levels, rgb_profile("", DISPLAY_P3, SRGB_CURVE))).max() <= 1
    path.write_bytes(with_png_chunk(plain, b"cICP", bytes((77, 13, 0, 1))))
    with pytest.warns(DermisWarning, match=r"code points \(77, 13\) are unknown"):
        assert read_colours(path)[1].is_default
    path.write_bytes(with_png_chunk(plain, b"gAMA", struct.pack(">I", 45455)))
    assert read_colours(path)[1].is_default  # what most programs write for sRGB


def test_avif_states_code_points(tmp_path: Path) -> None:
    data = encoded(np.full((32, 32, 3), 128, np.uint8), "AVIF")
    start = data.index(b"colrnclx") + 8
    path = tmp_path / "a.avif"
    path.write_bytes(data[:start] + struct.pack(">HH", 12, 8) + data[start + 4 :])
    with pytest.warns(DermisWarning, match="from Display P3 to sRGB"):
        np.testing.assert_allclose(linear(path), 128 / 255, atol=0.01)


def test_srgb_levels_are_decoded_unchanged(levels: Levels) -> None:
    space = gamma_colour_space("", None, None)
    assert space.is_default
    np.testing.assert_allclose(encode_srgb(space.to_linear(levels)) * 255, levels, atol=1e-3)
