"""Index and data sheet of a data set."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_observation import observation, small_spec, write_all, write_shard

from dermis.apps.batch.datasheet import write_datasheet
from dermis.apps.batch.index import MATRIX_COLUMNS, write_index
from dermis.apps.batch.records import encode_record
from dermis.apps.batch.shards import ShardWriter, list_shards
from dermis.apps.batch.spec import Spec
from dermis.base.errors import DermisError
from dermis.base.extras import import_extra

FIRST = ["number", "key", "shard", "camera.K", "camera.R", "camera.t", "head_pose", "gaze"]
KNOWN = [*FIRST, *MATRIX_COLUMNS, "split", "licence"]


@pytest.fixture(scope="module")
def drawn_spec() -> Spec:
    """Return a spec of 400 small images with known statistics."""
    return small_spec(
        count=400,
        shard_size=150,
        outputs=("depth", "label"),
        camera={"yaw_deg": {"uniform": [-40, 40]}},
        light={"kind": {"choice": ["studio", "rig"], "weights": [3, 1]}},
        environment={"name": {"choice": ["none", "lebombo"]}},
    )


@pytest.fixture(scope="module")
def described(drawn_spec: Spec, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with shards without pictures, index and data sheet."""
    folder = tmp_path_factory.mktemp("indexed")
    for shard in list_shards(drawn_spec):
        with ShardWriter(folder, shard, drawn_spec, "an adapter") as writer:
            for number in range(shard.first, shard.stop):
                if number == 7:
                    writer.leave_out(number, "a | head\nthat is damaged")
                    continue
                seen = observation(number, outputs=drawn_spec.outputs)
                found = encode_record(number, seen, drawn_spec.parameters(number), drawn_spec)
                writer.add(number, {"json": found["json"]})
    write_index(folder, drawn_spec)
    write_datasheet(folder, drawn_spec)
    return folder


def table(folder: Path) -> Any:
    return import_extra("pyarrow.parquet", "a test").read_table(folder / "index.parquet")


def test_each_image_has_a_row_with_all_its_parameters(described: Path, drawn_spec: Spec) -> None:
    found = table(described)
    numbers = found["number"].to_pylist()
    assert numbers == [number for number in range(400) if number != 7]
    assert found.column_names[: len(FIRST)] == FIRST
    rows = found.to_pylist()
    for row in (rows[0], rows[170], rows[-1]):
        truth = drawn_spec.parameters(row["number"])
        told = {name: value for name, value in row.items() if name not in KNOWN and value is not None}
        assert told == truth
        assert row["key"] == f"{row['number']:09d}"
        assert row["shard"] == f"shard-{row['number'] // 150:05d}.tar"
        seen = observation(row["number"])
        np.testing.assert_allclose(row["camera.t"], seen.camera.t, atol=1e-4)
        np.testing.assert_allclose(row["camera.K"], seen.camera.K.ravel(), atol=1e-4)
        np.testing.assert_allclose(row["head_pose"], seen.head_pose.ravel(), atol=1e-8)
    assert rows[2]["gaze"] is None
    lacked = {name for name in found.column_names if 0 < found[name].null_count < len(rows)}
    assert lacked > {"gaze"}, "parameters of what only some images have"


def test_statistics_are_those_of_the_spec(described: Path) -> None:
    found = table(described)
    yaw = found["camera.yaw_deg"].to_numpy()
    assert -40 <= yaw.min() < -35 and 35 < yaw.max() <= 40 and abs(yaw.mean()) < 3 * 23 / np.sqrt(400)
    studio = found["light.kind"].to_pylist().count("studio") / len(yaw)
    assert abs(studio - 0.75) < 3 * np.sqrt(0.75 * 0.25 / 400)


def test_equal_shards_give_equal_bytes(
    described: Path, drawn_spec: Spec, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = "index.parquet", "README.md", "dataset.json"
    before = [(described / name).read_bytes() for name in names]
    monkeypatch.setattr("time.time", lambda: 2e9)
    for name in names:
        (described / name).unlink()
    write_index(described, drawn_spec)
    write_datasheet(described, drawn_spec)
    assert [(described / name).read_bytes() for name in names] == before


def test_the_data_sheet_describes_the_data_set(described: Path, drawn_spec: Spec) -> None:
    text = (described / "README.md").read_text("utf-8")
    for line in (
        "| images | 399 of 400, 24 x 16 pixels |",
        "| shards | 3 of up to 150 images, format webdataset |",
        f"`{drawn_spec.digest()}`",
        "| depth.png | distance along the optical axis | mm | 16-bit PNG, level x 0.1 | 0 |",
        '| environment.name lebombo | "Lebombo", Poly Haven, polyhaven.com | CC0',
        "| people: the parametric human | MakeHuman community | CC0 |",
        "| 3 | adapter an adapter, dermis ",
        "| 7 | a \\| head that is damaged |",
        "| ibug-68 | 68 |",
        "| light.kind | 399 | studio (",
    ):
        assert line in text, line
    assert "dermis batch spec.toml -o FOLDER" in text


def test_programs_read_what_outputs_labels_and_landmarks_mean(described: Path) -> None:
    content = json.loads((described / "dataset.json").read_text("utf-8"))
    assert content["outputs"]["depth"]["step"] == 0.1 and content["outputs"]["depth"]["unit"] == "mm"
    assert content["labels"]["label"]["0"] == "background" and len(content["landmarks"]["ibug-68"]) == 68


def test_an_index_of_some_shards_has_their_rows(tmp_path: Path) -> None:
    spec = small_spec(outputs=())
    write_shard(tmp_path, list_shards(spec)[1], spec)
    write_index(tmp_path, spec)
    assert table(tmp_path)["number"].to_pylist() == [3, 4, 5]


def test_a_data_sheet_needs_its_index(tmp_path: Path) -> None:
    spec = small_spec(outputs=())
    write_all(tmp_path, spec)
    with pytest.raises(DermisError, match=r"a data set with index\.parquet, but it is missing"):
        write_datasheet(tmp_path, spec)
