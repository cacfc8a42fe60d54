"""Data sets of photographs: bytes of resumed ones, facts in records, and no change without [sensor]."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
import pytest
from small_set import contents, drawn, drawn_here, read, write_spec
from test_stream import first

import dermis
from dermis.apps.batch.preview import contact_sheet
from dermis.apps.batch.spec import Spec, parse_spec
from dermis.base.errors import DermisWarning
from dermis.dataset import Sensor, load_spec, photograph

COUNT = 10
SENSOR = """
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
        assert np.abs(ours["picture"].astype(int) - theirs["picture"]).max() <= 1
        np.testing.assert_array_equal(ours["depth"], theirs["depth"])


def test_lamps_that_the_white_balance_leaves_without_blue_are_noted() -> None:
    lamps = {"kind": "rig", "rim": {"kelvin": {"uniform": [1750, 4000]}}}
    with pytest.warns(DermisWarning, match=r"light\.rim: lamps of 1750 K .* white_balance = \"lights\""):
        parse_spec({"light": lamps, "sensor": {"white_kelvin": {"uniform": [3000, 6500]}}})
    parse_spec({"light": lamps, "sensor": {"white_balance": "lights"}})  # warnings are errors in tests
    parse_spec({"light": lamps, "sensor": {"white_kelvin": 3000}})
    parse_spec({"light": lamps | {"kind": "studio"}, "sensor": {}})


def test_the_contact_sheet_shows_photographs(small_spec: Spec) -> None:
    blue = small_spec.replace(count=1, sensor={"white_kelvin": 2500})
    plain, balanced = contact_sheet(small_spec.replace(count=1), "cpu"), contact_sheet(blue, "cpu")
    ratio = [sheet[..., 2].mean() / sheet[..., 0].mean() for sheet in (plain, balanced)]
    assert ratio[1] > 1.5 * ratio[0]


def test_the_canonical_text_gives_the_same_spec(spec: Spec, tmp_path: Path) -> None:
    write_spec(tmp_path)
    (tmp_path / "spec.toml").write_text(spec.to_toml())
    assert read(tmp_path / "spec.toml").digest() == spec.digest()
