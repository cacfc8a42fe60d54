"""Pictures as backgrounds of data sets: crops, blur, and composition in linear light."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from small_set import drawn_here, write_spec

import dermis
from dermis.apps.batch.backdrops import Crop, crop_box, picture_backdrop
from dermis.apps.batch.spec import Spec, parse_spec
from dermis.base.errors import DermisError
from dermis.images.colour import decode_srgb_levels, encode_srgb8

KIND = {"kind": "picture", "picture": {"files": "walls/*.png"}}


def spec_of(folder: Path, **values: Any) -> Spec:
    write_spec(folder)
    (folder / "walls").mkdir(exist_ok=True)
    rng = np.random.default_rng(2)
    for name, size in (("wide", (40, 90, 3)), ("tall", (80, 50, 3))):
        Image.fromarray(rng.integers(0, 256, size, np.uint8)).save(folder / "walls" / f"{name}.png")
    table = tomllib.loads((folder / "spec.toml").read_text())
    return parse_spec(table | {"count": 4, "outputs": ["alpha"]} | values, folder)


def test_crops_keep_the_shape_and_stay_inside() -> None:
    assert crop_box((900, 400), (200, 200), Crop(1.0, 0.5, 0.0)) == (250.0, 0.0, 650.0, 400.0)
    assert crop_box((900, 400), (200, 100), Crop(2.0, 1.0, 1.0)) == (500.0, 200.0, 900.0, 400.0)
    assert crop_box((50, 80), (10, 10), Crop(1.0, 0.0, 1.0)) == (0.0, 30.0, 50.0, 80.0)


def test_backgrounds_are_parts_of_the_pictures(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, background=KIND)
    assert set(spec.files) >= {"walls/tall.png", "walls/wide.png"}
    assert drawn_here(spec, tmp_path / "out").is_complete
    for image in dermis.read_dataset(tmp_path / "out"):
        parameters, uncovered = image["parameters"], image["alpha"] == 0
        assert image["picture"].shape == (32, 32, 3) and uncovered.sum() > 50
        source = decode_srgb_levels(np.asarray(Image.open(tmp_path / parameters["background.picture"])))
        height, width = source.shape[:2]
        side = min(height, width)
        left, upper = (
            parameters["background.crop_x"] * (width - side),
            parameters["background.crop_y"] * (height - side),
        )
        crop = source[round(upper) : round(upper) + side, round(left) : round(left) + side]
        mean = crop.reshape(-1, 3).mean(axis=0)  # the same area for any interpolation
        shown = decode_srgb_levels(image["picture"])[uncovered].mean(axis=0)
        np.testing.assert_allclose(shown, mean, atol=0.06)
        assert "a file of the spec" in image["licence"]


def test_people_are_composited_over_the_background_in_linear_light(tmp_path: Path) -> None:
    Image.fromarray(np.full((32, 32, 3), 188, np.uint8)).save(tmp_path / "grey.png")
    grey = {"kind": "picture", "picture": "grey.png"}
    clear = spec_of(
        tmp_path, background={"kind": "none"}, render={"atlas": 64, "samples": 4, "shadow_size": 64}
    )
    spec = spec_of(tmp_path, background=grey, render={"atlas": 64, "samples": 4, "shadow_size": 64})
    images = []
    for name, one in (("clear", clear), ("over", spec)):
        assert drawn_here(one.replace(count=1), tmp_path / name).is_complete
        images += dermis.read_dataset(tmp_path / name)
    alpha = images[0]["picture"][..., 3:] / 255
    linear = alpha * decode_srgb_levels(images[0]["picture"][..., :3]) + (1 - alpha) * decode_srgb_levels(
        np.full((32, 32, 3), 188, np.uint8)
    )
    assert ((alpha > 0.1) & (alpha < 0.9)).any()
    assert np.abs(encode_srgb8(linear).astype(int) - images[1]["picture"]).max() <= 1


def test_photographs_have_pictures_as_backgrounds(tmp_path: Path) -> None:
    Image.fromarray(np.full((32, 32, 3), 120, np.uint8)).save(tmp_path / "grey.png")
    spec = spec_of(
        tmp_path, background={"kind": "picture", "picture": "grey.png"}, sensor={}, lens={"k1": -0.2}
    )
    assert drawn_here(spec.replace(count=1), tmp_path / "out").is_complete
    (image,) = dermis.read_dataset(tmp_path / "out")
    assert np.abs(image["picture"][image["alpha"] == 0].astype(int) - 120).max() <= 1


def test_blur_keeps_the_mean_and_removes_details(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    Image.fromarray(rng.integers(0, 256, (64, 64, 3), np.uint8)).save(tmp_path / "noise.png")
    sharp, soft = (
        picture_backdrop(tmp_path / "noise.png", (64, 64), Crop(1, 0, 0), blur) for blur in (0, 0.3)
    )
    assert soft.mean() == pytest.approx(sharp.mean(), rel=0.02)
    # the variance of white noise after a Gaussian of standard deviation s is 1 / (4 pi s^2) of the original
    assert soft.var() / sharp.var() == pytest.approx(1 / (4 * np.pi * 1.92**2), rel=0.3)


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"background": {"kind": "picture"}}, "picture = {files"),
        ({"background": {"zoom": 2}}, 'kind = "picture" for the keys zoom'),
        ({"background": {"kind": "picture", "picture": "none.png"}}, "background: picture: expected files"),
        (
            {"background": KIND, "rig": {"kind": "stereo"}},
            "background: picture: expected one camera",
        ),
    ],
)
def test_invalid_tables_are_refused(tables: dict[str, Any], message: str, tmp_path: Path) -> None:
    spec_of(tmp_path)
    with pytest.raises(DermisError, match=message):
        parse_spec(tables, tmp_path)


def test_arrays_have_the_same_numbers_with_and_without_a_picture(tmp_path: Path) -> None:
    kinds = {"kind": {"choice": ["picture", "gradient"]}, "picture": {"files": "walls/*.png"}}
    spec = spec_of(tmp_path, background=kinds)
    assert drawn_here(spec, tmp_path / "out").is_complete
    images = list(dermis.read_dataset(tmp_path / "out"))
    names = [image["parameters"]["background.picture"] for image in images]
    assert None in names and {*names} - {None}
    lengths = {len(dermis.dataset.arrays(image)["parameters"]) for image in images}
    assert lengths == {len(dermis.dataset.parameter_names(spec))}


def test_without_pictures_specs_are_unchanged() -> None:
    assert "picture" not in parse_spec({"seed": 3}).to_toml()
