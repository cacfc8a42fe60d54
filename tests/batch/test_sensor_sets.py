"""Data sets of photographs: bytes of resumed ones, facts in records, and no change without [sensor]."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
import pytest
from scipy import ndimage
from small_set import contents, drawn, drawn_here, read, write_spec
from test_stream import first

import dermis
from dermis.apps.batch.face_boxes import box_points
from dermis.apps.batch.preview import contact_sheet
from dermis.apps.batch.spec import Spec, parse_spec
from dermis.base.errors import DermisWarning
from dermis.dataset import Lens, Sensor, load_spec, photograph
from dermis.frame.features.post.background import studio_backdrop
from dermis.images.colour import decode_srgb_levels, encode_srgb8
from dermis.scene.frozen_model import FrozenModel, accepted_values, format_default
from dermis.scene.smoothness import SmoothOutlineLevels

COUNT = 10
SENSOR = """
[lens]
k1 = {choice = [0, {uniform = [-2, 2]}], weights = [1, 3]}
p1 = {choice = [0, {uniform = [-0.02, 0.02]}]}

[sensor]
vignetting = {uniform = [0, 4]}
white_balance = {choice = ["kelvin", "lights"]}
white_kelvin = {uniform = [4000, 8000]}
white_error_mired = {truncated = [0, 10, -30, 30]}
iso = {choice = [0, {log_uniform = [100, 3200]}]}
demosaicing = {choice = ["none", "bilinear", "malvar"]}
tone_curve = {choice = ["srgb", "phone"]}
jpeg_quality = {choice = [0, {uniform = [60, 95]}]}
"""
pytestmark = pytest.mark.usefixtures("many_form_factor_lines")  # as in other processes


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("photographs")
    path = write_spec(made)
    text = path.read_text().replace("shard_size = 20", "shard_size = 20\nkeep_linear = true")
    text = text.replace('["depth", "normal"]', '["depth", "label", "normal", "position"]')
    path.write_text(text + SENSOR)
    return made


@pytest.fixture(scope="module")
def spec(folder: Path) -> Spec:
    return load_spec(folder / "spec.toml", count=COUNT)


@pytest.fixture(scope="module")
def files(folder: Path, spec: Spec) -> dict[str, bytes]:
    assert drawn_here(spec, folder / "out").is_complete
    return contents(folder / "out")


def images(folder: Path, files: dict[str, bytes]) -> list[dict[str, Any]]:
    assert files
    return list(dermis.read_dataset(folder / "out"))


def test_a_resumed_data_set_with_encoders_has_the_same_bytes(
    spec: Spec, files: dict[str, bytes], tmp_path: Path
) -> None:
    drawn_here(spec.replace(count=4), tmp_path / "out")
    drawn(spec, tmp_path / "out", 1, 1)
    assert contents(tmp_path / "out") == files


def test_records_and_linear_pictures_reproduce_the_photographs(folder: Path, files: dict[str, bytes]) -> None:
    seen = set()
    for image in images(folder, files):
        values = {
            name.removeprefix("sensor."): value
            for name, value in image["parameters"].items()
            if name.startswith("sensor.") and value is not None
        }
        white, light = (
            [values.pop(f"{name}_{channel}") for channel in ("red", "green", "blue")]
            for name in ("white", "light")
        )
        seed, clipped = int(values.pop("seed", 0)), values.pop("clipped_fraction")
        sensor = Sensor(**values)
        found = photograph(image["linear"], sensor, K=image["camera"].K, light_colour=light, seed=seed)
        np.testing.assert_array_equal(found.picture, image["picture"])
        np.testing.assert_allclose(found.white, white, rtol=1e-5, atol=1e-8)
        assert found.clipped_fraction == pytest.approx(clipped, rel=1e-5)
        seen |= {(sensor.demosaicing, bool(sensor.iso)), sensor.tone_curve, sensor.white_balance}
    assert len(seen) >= 7


def opencv_pixels(image: dict[str, Any], positions_mm: Any) -> Any:
    """Project points by OpenCV's formula, written for one point at a time."""
    camera, pixels = image["camera"], []
    k1, k2, p1, p2, k3 = (image["parameters"][f"lens.{name}"] for name in ("k1", "k2", "p1", "p2", "k3"))
    for point in positions_mm.reshape(-1, 3).astype(float):
        X, Y, Z = camera.R @ point + camera.t
        a, b = X / Z, Y / Z
        r2 = a * a + b * b
        d = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
        u = a * d + 2 * p1 * a * b + p2 * (r2 + 2 * a * a)
        v = b * d + p1 * (r2 + 2 * b * b) + 2 * p2 * a * b
        pixels.append((camera.K @ [u, v, 1])[:2])
    return np.array(pixels)


def test_outputs_landmarks_and_boxes_are_behind_the_lens(folder: Path, files: dict[str, bytes]) -> None:
    """Each pixel's position is imaged at this pixel, except near outlines, where classes are not mixed."""
    moved = []
    for image in images(folder, files):
        seen = image["depth"] > 0
        np.testing.assert_array_equal(seen, image["label"] > 0)
        y, x = np.nonzero(seen)
        errors = np.linalg.norm(opencv_pixels(image, image["position"][seen]) - np.stack([x, y], -1), axis=1)
        assert np.median(errors) < 0.05 and errors.max() < 0.8
        assert np.linalg.norm(image["normal"][seen], axis=-1) == pytest.approx(1, abs=1e-3)
        points = image["landmarks"]["points.csv"]
        found = opencv_pixels(image, points.positions_mm)
        np.testing.assert_allclose(points.pixels, found, atol=2e-3)
        pinhole = (points.positions_mm @ image["camera"].R.T + image["camera"].t) @ image["camera"].K.T
        moved.append(np.abs(pinhole[:, :2] / pinhole[:, 2:] - points.pixels).max())
        path = folder / image["parameters"]["person.head"]
        head = dermis.load_head(path, subdivide=SmoothOutlineLevels(size=(32, 32)))
        for name, indices in box_points(head).items():
            vertices = head.control_rig.positions_mm[indices] - np.array(head.centre_mm)
            corners = opencv_pixels(image, vertices)
            expected = [*corners.min(axis=0), *corners.max(axis=0)]
            np.testing.assert_allclose(image["boxes"][name], expected, atol=2e-3)
    assert max(moved) > 0.3 and min(moved) < 0.01  # pixels, of 32


def test_the_index_and_the_sheet_describe_the_photographs(folder: Path, files: dict[str, bytes]) -> None:
    rows = parquet.read_table(folder / "out" / "index.parquet").to_pylist()
    isos = {row["key"]: row["sensor.iso"] for row in rows}
    assert set(isos.values()) > {0.0}
    for row in rows:
        assert (row["sensor.seed"] is None) is (row["sensor.iso"] == 0)
        assert (row["sensor.contrast"] is None) is (row["sensor.tone_curve"] == "srgb")
        assert row["sensor.white_green"] > 0 and row["sensor.read_noise_electrons"] in (None, 2.0)
    assert (
        b"linear.exr" in files["README.md"] and b"as the camera of [sensor] stores it" in files["README.md"]
    )


def test_streamed_photographs_are_those_of_the_data_set(
    folder: Path, spec: Spec, files: dict[str, bytes]
) -> None:
    names = dermis.dataset.parameter_names(spec)
    for ours, theirs in zip(first(spec, 3), images(folder, files), strict=False):
        theirs = dermis.dataset.arrays(theirs)
        assert set(ours) == set(theirs)
        np.testing.assert_array_equal(ours["picture"], theirs["picture"])
        np.testing.assert_array_equal(ours["parameters"], theirs["parameters"])
        np.testing.assert_array_equal(ours["linear"], theirs["linear"])
        assert ours["parameters"].shape == (len(names),)


def test_without_the_table_specs_and_parameters_are_unchanged() -> None:
    plain, with_sensor = parse_spec({"seed": 3}), parse_spec({"seed": 3, "sensor": {"iso": 400}})
    assert "sensor" not in plain.to_toml() and "keep_linear" not in plain.to_toml()
    assert parse_spec({"seed": 3, "keep_linear": False}).digest() == plain.digest() != with_sensor.digest()
    for number in range(20):
        shared = plain.parameters(number)
        others = {k: v for k, v in with_sensor.parameters(number).items() if not k.startswith("sensor.")}
        assert others == shared


def test_an_empty_table_has_all_defaults_and_leaves_pictures_unchanged(
    folder: Path, small_spec: Spec, undisturbed: dict[str, bytes], small_folder: Path, tmp_path: Path
) -> None:
    neutral = small_spec.replace(count=3, sensor={})
    assert set(Sensor.model_fields) == set(neutral.sensor or ())
    drawn_here(neutral, tmp_path / "out")
    plain = dermis.read_dataset(small_folder / "undisturbed")
    for ours, theirs in zip(dermis.read_dataset(tmp_path / "out"), plain, strict=False):
        difference = np.abs(ours["picture"].astype(int) - theirs["picture"])
        skin = ndimage.binary_erosion(ours["depth"] > 0)
        assert skin.sum() > 100 and difference[skin].max() <= 1
        np.testing.assert_array_equal(ours["depth"], theirs["depth"])
        # the background has the colour of the lights
        light = [ours["parameters"][f"sensor.light_{channel}"] for channel in ("red", "green", "blue")]
        ratio = decode_srgb_levels(ours["picture"][0, 0]) / decode_srgb_levels(theirs["picture"][0, 0])
        np.testing.assert_allclose(ratio, light, rtol=0.06)  # rounding to 8 bits


def test_lamps_that_the_white_balance_leaves_without_blue_are_noted() -> None:
    lamps = {"kind": "rig", "rim": {"kelvin": {"uniform": [1750, 4000]}}}
    with pytest.warns(DermisWarning, match=r"light\.rim: lamps down to 1750 K .* white_balance = \"lights\""):
        parse_spec({"light": lamps, "sensor": {"white_kelvin": {"uniform": [3000, 6500]}}})
    parse_spec({"light": lamps, "sensor": {"white_balance": "lights"}})  # warnings are errors in tests
    parse_spec({"light": lamps, "sensor": {"white_kelvin": 3000}})
    parse_spec({"light": lamps | {"kind": "studio"}, "sensor": {}})


@pytest.mark.parametrize("kind", ["gradient", "colour"])
def test_backgrounds_of_grey_walls_are_grey_in_balanced_light(
    kind: str, small_spec: Spec, tmp_path: Path
) -> None:
    lamp = {"kelvin": 2400}
    wall = {"kind": kind, "red": 0.3, "green": 0.3, "blue": 0.3}
    table = tomllib.loads((small_spec.folder / "spec.toml").read_text()) | {
        "count": 2,
        "outputs": ["alpha"],
        "light": {"kind": "rig", "key": lamp, "fill": lamp, "rim": lamp},
        "background": wall,
        "sensor": {"white_balance": "lights"},
    }
    spec = parse_spec(table, small_spec.folder)
    drawn_here(spec, tmp_path / "out")
    for image in dermis.read_dataset(tmp_path / "out"):
        seen = image["picture"][image["alpha"] == 0].astype(int)
        assert len(seen) > 100
        expected = encode_srgb8(0.3) if kind == "colour" else encode_srgb8(studio_backdrop((32, 32)))
        expected = np.broadcast_to(expected, image["picture"].shape)[image["alpha"] == 0]
        tolerance = 1 if kind == "colour" else 3  # the backdrop is not quite grey
        assert np.abs(seen - expected).max() <= tolerance


def test_the_contact_sheet_shows_photographs(small_spec: Spec) -> None:
    blue = small_spec.replace(count=1, sensor={"white_kelvin": 2500})
    plain, balanced = contact_sheet(small_spec.replace(count=1), "cpu"), contact_sheet(blue, "cpu")
    ratio = [sheet[..., 2].mean() / sheet[..., 0].mean() for sheet in (plain, balanced)]
    assert ratio[1] > 1.5 * ratio[0]


@pytest.mark.parametrize("model", [Sensor, Lens])
def test_the_page_lists_all_keys_with_their_bounds(model: type[FrozenModel]) -> None:
    page = (Path(__file__).parents[2] / "docs" / "batch.md").read_text(encoding="utf-8")
    table = page.partition(f"| key of `[{model.__name__.lower()}]` |")[2].partition("\n\n")[0]
    listed = [tuple(cell.strip() for cell in row.split("|")[1:4]) for row in table.splitlines()[2:]]
    defaults = model()
    assert listed == [
        (f"`{name}`", accepted_values(model, name), format_default(getattr(defaults, name)))
        for name in model.model_fields
    ]


def test_the_canonical_text_gives_the_same_spec(spec: Spec, tmp_path: Path) -> None:
    write_spec(tmp_path)
    (tmp_path / "spec.toml").write_text(spec.to_toml())
    assert read(tmp_path / "spec.toml").digest() == spec.digest()
