"""Photographs as cameras and phones write them: turned, with profiles, in CMYK, deep, grey or cut out."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from icc_profiles import DISPLAY_P3, SRGB_CURVE, encoded, rgb_profile
from numpy.typing import NDArray

from dermis.apps.inverse.fitting.fit import warn_of_poor_fit
from dermis.apps.inverse.fitting.inputs import read_photograph
from dermis.apps.inverse.unmixing.unmix import unmix
from dermis.base.errors import DermisError, DermisWarning
from dermis.images.codecs import encode_png
from dermis.images.colour import decode_srgb
from dermis.images.io import write_exr

Bytes = NDArray[np.uint8]


@pytest.fixture
def pixels() -> Bytes:
    return np.random.default_rng(4).integers(30, 200, (18, 24, 3)).astype(np.uint8)


def turned(pixels: Bytes, orientation: int = 6) -> bytes:
    """Return a PNG file that EXIF turns clockwise."""
    from PIL import Image

    exif = Image.Exif()
    exif[0x112] = orientation
    return encoded(pixels, "PNG", exif=exif)


def test_photograph_is_rotated_by_exif_orientation(tmp_path: Path, pixels: Bytes) -> None:
    path = tmp_path / "face.png"
    path.write_bytes(turned(pixels))
    with pytest.warns(DermisWarning, match=r"face\.png: it is turned upright"):
        photo = read_photograph(path)
    assert photo.size == (18, 24)
    np.testing.assert_array_equal(photo.linear, read_photograph(np.rot90(pixels, -1)).linear)


@pytest.mark.skipif(not os.environ.get("DERMIS_DATA"), reason="DERMIS_DATA is not set")
def test_rotated_photograph_equals_the_upright_one() -> None:
    folder = Path(os.environ["DERMIS_DATA"]) / "field" / "photo"
    with pytest.warns(DermisWarning, match="it is turned upright"):
        turned = read_photograph(folder / "b_exif6.jpg")
    plain = read_photograph(folder / "a_plain.jpg")
    assert turned.size == plain.size
    assert np.abs(turned.linear - plain.linear).mean() < 0.01


def test_colours_of_display_p3_are_converted_and_clipped_levels_stay_clipped(
    tmp_path: Path, pixels: Bytes
) -> None:
    pixels[3, 4] = (255, 100, 90)
    path = tmp_path / "face.png"
    path.write_bytes(encoded(pixels, "PNG", icc_profile=rgb_profile("Display P3", DISPLAY_P3, SRGB_CURVE)))
    with pytest.warns(DermisWarning, match=r"face\.png: its colours are converted from Display P3 to sRGB"):
        photo = read_photograph(path)
    to_rec709 = np.array([[1.22494, -0.22494, 0.0], [-0.04206, 1.04206, 0.0], [-0.01964, -0.07864, 1.09827]])
    expected = np.clip(decode_srgb(pixels / 255.0) @ to_rec709.T, 0.0, 1.0)
    np.testing.assert_allclose(photo.linear, expected, atol=1e-3)
    assert photo.unclipped[3, 4] == 0.0 and photo.unclipped.sum() == 18 * 24 - 1


def test_cmyk_16_bit_and_grey_photographs_are_read(tmp_path: Path, pixels: Bytes) -> None:
    inks = np.dstack([255 - pixels, np.zeros(pixels.shape[:2], np.uint8)])
    (tmp_path / "cmyk.tif").write_bytes(encoded(inks, "TIFF", "CMYK"))
    with pytest.warns(DermisWarning, match=r"cmyk\.tif: its CMYK is converted"):
        cmyk = read_photograph(tmp_path / "cmyk.tif")
    deep = pixels.astype(np.uint16) * 257
    (tmp_path / "deep.png").write_bytes(encode_png(deep))
    (tmp_path / "grey.png").write_bytes(encode_png(pixels[..., :1]))
    with pytest.warns(DermisWarning, match=r"grey\.png: it is grey"):
        grey = read_photograph(tmp_path / "grey.png")
    plain = read_photograph(pixels).linear
    np.testing.assert_allclose(cmyk.linear, plain, atol=0.01)
    np.testing.assert_allclose(read_photograph(tmp_path / "deep.png").linear, plain, atol=1e-6)
    np.testing.assert_allclose(grey.linear, plain[..., [0, 0, 0]], atol=1e-6)


def test_transparent_pixels_are_not_fitted(tmp_path: Path, pixels: Bytes) -> None:
    alpha = np.full(pixels.shape[:2], 255, np.uint8)
    alpha[:, :6] = 0
    with pytest.warns(DermisWarning, match="its 108 transparent pixels are not fitted"):
        photo = read_photograph(np.dstack([pixels, alpha]))
    assert not photo.unclipped[:, :6].any() and photo.unclipped[:, 6:].all()
    assert read_photograph(np.dstack([pixels, 0 * alpha])).unclipped.all()  # alpha that programs leave at 0


def test_invalid_pixels_of_a_linear_photograph_are_replaced(tmp_path: Path) -> None:
    linear = np.full((18, 24, 3), 0.25, np.float32)
    linear[2, 3], linear[4, 5] = np.nan, -0.01
    write_exr(tmp_path / "face.exr", linear)
    with pytest.warns(DermisWarning, match="1 infinite or NaN and 1 negative pixels of 432"):
        photo = read_photograph(tmp_path / "face.exr")
    assert photo.linear.sum() == pytest.approx(0.25 * 3 * 430)
    write_exr(tmp_path / "face.exr", np.full_like(linear, np.nan))
    with pytest.raises(DermisError, match=r"face\.exr: expected a picture of radiance"):
        read_photograph(tmp_path / "face.exr")


def test_unmixed_maps_are_oriented_like_the_photograph(tmp_path: Path) -> None:
    colours = np.zeros((8, 12, 3), np.uint8)
    colours[:, :6], colours[:, 6:] = (220, 170, 150), (130, 90, 70)
    path = tmp_path / "skin.png"
    path.write_bytes(turned(colours))
    with pytest.warns(DermisWarning, match=r"skin\.png: it is turned upright"):
        result = unmix(path, adapter="cpu")
    assert result.melanin.shape == (12, 8)
    assert result.melanin[6:].mean() > 2 * result.melanin[:6].mean()


def test_a_large_residual_is_explained() -> None:
    warn_of_poor_fit("face.jpg", 0.05)
    with pytest.warns(
        DermisWarning,
        match=r"face\.jpg: the fit differs from it by 25 %.*does not show the head in this place",
    ):
        warn_of_poor_fit("face.jpg", 0.25)
