"""Maps from picture files, and files that are refused by name."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis.base.errors import DermisError, DermisWarning
from dermis.formats import maps as map_pixels
from dermis.formats.maps import load_maps
from dermis.images.colour_spaces import SRGB, ColourSpace
from dermis.images.filters import mip_chain, smooth_quantisation
from dermis.images.io import read_image, write_exr, write_png
from dermis.mesh.maps import Maps

SHAPE = (24, 32)


def _png(path: Path, pixels: np.ndarray) -> Path:
    write_png(path, pixels)
    return path


def _encoded(normals: np.ndarray, full: int = 255) -> np.ndarray:
    unit = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    dtype = np.uint8 if full == 255 else np.uint16
    return np.rint((unit + 1) / 2 * full).astype(dtype)


def test_no_files_give_no_maps() -> None:
    assert load_maps() == Maps()


def test_colour_is_decoded_from_srgb_at_both_depths(tmp_path: Path) -> None:
    grey = np.full((*SHAPE, 4), 188, np.uint8)
    for name, pixels in (("8.png", grey), ("16.png", grey.astype(np.uint16) * 257)):
        colour = load_maps(colour=_png(tmp_path / name, pixels)).colour
        assert colour is not None
        assert colour.shape == (*SHAPE, 3)
        np.testing.assert_allclose(colour, 0.502887, atol=1e-6)


def test_float_colour_is_linear_already(tmp_path: Path) -> None:
    write_exr(tmp_path / "c.exr", np.full((*SHAPE, 3), 0.25, np.float32))
    colour = load_maps(colour=tmp_path / "c.exr").colour
    np.testing.assert_array_equal(colour, np.full((*SHAPE, 3), 0.25, np.float32))


def test_grey_colour_is_repeated_in_all_channels_with_a_note(tmp_path: Path) -> None:
    path = _png(tmp_path / "g.png", np.full(SHAPE, 188, np.uint8))
    with pytest.warns(DermisWarning, match=r"g\.png: it is grey"):
        colour = load_maps(colour=path).colour
    assert colour is not None and colour.shape == (*SHAPE, 3)
    np.testing.assert_allclose(colour, 0.502887, atol=1e-6)


def test_height_is_read_equally_at_every_bit_depth(tmp_path: Path) -> None:
    levels = np.random.default_rng(0).integers(0, 256, SHAPE).astype(np.uint8)
    write_exr(tmp_path / "h.exr", np.repeat(levels[..., None] / 255, 3, axis=2))
    deep = _png(tmp_path / "16.png", levels.astype(np.uint16) * 257)
    relief = levels * 0.025
    for path in (deep, tmp_path / "h.exr"):
        np.testing.assert_allclose(load_maps(height=path, height_mm=0.025).height, relief, atol=1e-6)
    eight = load_maps(height=_png(tmp_path / "8.png", levels), height_mm=0.025).height
    np.testing.assert_allclose(eight, smooth_quantisation(relief), atol=1e-6)


def test_a_large_file_is_decoded_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DERMIS_CACHE", str(tmp_path / "cache"))
    decoded: list[str] = []

    def counted(path: Path) -> np.ndarray:
        decoded.append(path.name)
        return read_image(path)

    def counted_colours(path: Path, upright: bool) -> tuple[np.ndarray, ColourSpace]:
        return counted(path), SRGB

    monkeypatch.setattr(map_pixels, "read_image", counted)
    monkeypatch.setattr(map_pixels, "read_colours", counted_colours)
    rng = np.random.default_rng(5)
    noise = rng.integers(0, 256, (256, 256, 3)).astype(np.uint8)
    up = _png(tmp_path / "n.png", _encoded(np.dstack([0.1 * rng.random((256, 256, 2)), np.ones((256, 256))])))
    given: list[dict[str, Any]] = [
        {"colour": _png(tmp_path / "c.png", noise), "normal": up},
        {
            "height": _png(tmp_path / "h.png", noise[..., 0]),
            "height_mm": 0.02,
            "roughness": tmp_path / "h.png",
        },
        {"height": tmp_path / "h.png", "height_mm": 0.03, "specular": tmp_path / "h.png"},
        {"normal": up, "normal_y": "down", "region": tmp_path / "h.png"},
    ]
    first, second = ([load_maps(**one) for one in given] for _ in range(2))
    assert sorted(decoded) == ["c.png", *4 * ["h.png"], *2 * ["n.png"]]
    for one, other in zip(first, second, strict=True):
        for a, b in zip(vars(one).values(), vars(other).values(), strict=True):
            assert (a is None and b is None) or (a.dtype == b.dtype and np.array_equal(a, b))
    assert first[1].height is not None and first[2].height is not None
    np.testing.assert_allclose(first[2].height, 1.5 * first[1].height, rtol=1e-6)
    assert not np.array_equal(first[0].normal, first[3].normal)
    _png(tmp_path / "c.png", noise[::-1])
    np.testing.assert_array_equal(load_maps(colour=tmp_path / "c.png").colour, first[0].colour[::-1])  # type: ignore[index]


def test_a_large_file_of_another_kind_is_refused_each_time(tmp_path: Path) -> None:
    noise = np.random.default_rng(6).integers(0, 256, (128, 128, 3)).astype(np.uint8)
    path = _png(tmp_path / "c.png", noise)
    load_maps(colour=path)
    for _ in range(2):
        for role in ("normal", "specular"):
            with pytest.raises(DermisError, match=r"c\.png"):
                load_maps(**{role: path})  # type: ignore[arg-type]


def test_8_bit_quantisation_is_smoothed_and_slopes_stay() -> None:
    ramp = np.arange(64)[None, :] * 0.13 + np.arange(48)[:, None] * 0.07
    inside = (slice(4, -4), slice(4, -4))
    np.testing.assert_allclose(smooth_quantisation(ramp)[inside], ramp[inside], atol=1e-5)
    across = np.diff(smooth_quantisation(np.round(ramp))[inside], axis=1)
    assert across.std() < np.diff(np.round(ramp)[inside], axis=1).std() / 3


def test_normals_are_converted_to_slopes(tmp_path: Path) -> None:
    slope_u, slope_up = 0.3, -0.2
    normals = np.broadcast_to([-slope_u, -slope_up, 1.0], (*SHAPE, 3))
    for full, error in ((255, 0.01), (65535, 4e-5)):
        path = _png(tmp_path / f"{full}.png", _encoded(normals, full))
        up, down = load_maps(normal=path).normal, load_maps(normal=path, normal_y="down").normal
        np.testing.assert_allclose(up, np.broadcast_to([slope_u, slope_up], (*SHAPE, 2)), atol=error)
        np.testing.assert_allclose(down, np.broadcast_to([slope_u, -slope_up], (*SHAPE, 2)), atol=error)


def test_signed_float_normals_are_recognised(tmp_path: Path) -> None:
    unit = np.array([-0.6, 0.0, 0.8], np.float32)
    write_exr(tmp_path / "n.exr", np.tile(unit, (*SHAPE, 1)))
    write_exr(tmp_path / "m.exr", np.tile((unit + 1) / 2, (*SHAPE, 1)))
    for name in ("n.exr", "m.exr"):
        slopes = load_maps(normal=tmp_path / name).normal
        np.testing.assert_allclose(slopes, np.broadcast_to([0.75, 0], (*SHAPE, 2)), atol=1e-5)


def test_unused_texels_of_a_normal_map_are_flat(tmp_path: Path) -> None:
    pixels = np.zeros((*SHAPE, 3), np.uint8)
    pixels[:12] = (128, 128, 255)
    slopes = load_maps(normal=_png(tmp_path / "n.png", pixels)).normal
    assert slopes is not None
    assert np.abs(slopes[12:]).max() == 0
    assert np.abs(slopes).max() < 0.005


def test_grey_maps_are_read_linearly(tmp_path: Path) -> None:
    path = _png(tmp_path / "g.png", np.full((*SHAPE, 3), 51, np.uint8))
    maps = load_maps(specular=path, roughness=path)
    np.testing.assert_allclose(maps.specular, np.full(SHAPE, 0.2), atol=1e-7)
    np.testing.assert_allclose(maps.roughness, np.full(SHAPE, 0.2), atol=1e-7)


def _refused(folder: Path) -> dict[str, tuple[str, np.ndarray, str]]:
    """Return role, pixels and expected message by file name."""
    rng = np.random.default_rng(1)
    colour = rng.integers(0, 256, (*SHAPE, 3)).astype(np.uint8)
    skin = np.broadcast_to(np.array([193, 153, 140], np.uint8), (*SHAPE, 3)).copy()
    return {
        "coloured_height.png": ("height", colour, "grey"),
        "coloured_specular.png": ("specular", skin, "grey"),
        "grey_normal.png": ("normal", colour[..., :1], "grey"),
        "skin_normal.png": ("normal", skin, "normal map"),
        "white_normal.png": ("normal", np.full((*SHAPE, 3), 255, np.uint8), "normal map"),
        "light_grey_normal.png": ("normal", np.full((*SHAPE, 3), 200, np.uint8), "normal map"),
        "wide_colour.png": ("colour", np.zeros((1, 16385, 3), np.uint8), "16385 x 1"),
    }


def test_wrong_maps_are_refused_by_name(tmp_path: Path) -> None:
    for name, (role, pixels, says) in _refused(tmp_path).items():
        path = _png(tmp_path / name, pixels)
        with pytest.raises(DermisError, match=name) as caught:
            load_maps(**{role: path}, height_mm=0.025)  # type: ignore[arg-type]
        assert says in str(caught.value)


@pytest.mark.parametrize("height_mm", [None, 0.0, -1.0, float("nan")])
def test_height_needs_its_scale(tmp_path: Path, height_mm: float | None) -> None:
    path = _png(tmp_path / "h.png", np.zeros(SHAPE, np.uint8))
    with pytest.raises(DermisError, match=r"h\.png.*height_mm"):
        load_maps(height=path, height_mm=height_mm)


@pytest.mark.parametrize(("value", "says"), [(np.nan, "finite"), (3.0, "0 to 1")])
def test_float_colours_are_checked(tmp_path: Path, value: float, says: str) -> None:
    pixels = np.full((*SHAPE, 3), 0.5, np.float32)
    pixels[3, 4, 1] = value
    write_exr(tmp_path / "c.exr", pixels)
    with pytest.raises(DermisError, match=rf"c\.exr.*{says}"):
        load_maps(colour=tmp_path / "c.exr")


def test_unknown_green_channel_direction_is_refused(tmp_path: Path) -> None:
    path = _png(tmp_path / "n.png", np.full((*SHAPE, 3), (128, 128, 255), np.uint8))
    with pytest.raises(DermisError, match="normal_y"):
        load_maps(normal=path, normal_y="left")  # type: ignore[arg-type]


@pytest.mark.skipif(not os.environ.get("DERMIS_DATA"), reason="DERMIS_DATA is not set")
def test_head_scan_normals_match_its_heights() -> None:
    from dermis.formats.samples import SAMPLES, fetch_sample

    files, height_mm = fetch_sample("lee_perry_smith"), SAMPLES["lee_perry_smith"].height_mm
    maps = load_maps(normal=files["normal"], height=files["height"], height_mm=height_mm)
    assert maps.height is not None
    assert maps.normal is not None
    dy, dx = np.gradient(mip_chain(maps.height)[2])
    assert np.corrcoef(maps.normal[..., 0].ravel(), dx.ravel())[0, 1] > 0.2
    # Rows go down, slopes go up.
    assert np.corrcoef(maps.normal[..., 1].ravel(), -dy.ravel())[0, 1] > 0.2


@pytest.mark.skipif(not os.environ.get("DERMIS_DATA"), reason="DERMIS_DATA is not set")
def test_head_scan_has_no_other_normal_map() -> None:
    from dermis.formats.samples import fetch_sample

    files = fetch_sample("lee_perry_smith")
    for role in ("colour", "specular"):
        with pytest.raises(DermisError, match=files[role].name):
            load_maps(normal=files[role])


@pytest.mark.parametrize("side", [16, 100, 2048])
def test_mean_colour_is_over_covered_texels(side: int) -> None:
    """It is correct for small maps, too, and computed once."""
    colour = np.random.default_rng(4).uniform(0.1, 0.9, (side, side, 3)).astype(np.float32)
    colour[:, side // 2 :] = 0.0
    maps = Maps(colour=colour)
    mean = maps.mean_colour
    assert mean is not None and mean is maps.mean_colour
    assert np.abs(mean - colour[:, : side // 2].mean(axis=(0, 1))).max() < 0.02
    assert Maps().mean_colour is None
