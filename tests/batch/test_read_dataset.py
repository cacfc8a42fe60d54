"""Reading of data sets in both formats, by dermis and by the library webdataset."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
import tarfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_observation import OUTPUT_NAMES, observation, small_spec, write_all

import dermis
from dermis.apps.batch.image_facts import image_split
from dermis.apps.batch.index import write_index
from dermis.apps.batch.output_encoding import encode_output
from dermis.apps.batch.reader import decode_image
from dermis.apps.batch.records import encode_record
from dermis.base.errors import DermisError
from dermis.base.extras import import_extra
from dermis.frame.observation import Landmarks

PAGE = Path(__file__).resolve().parents[2] / "docs" / "dataset_files.md"


@pytest.fixture(scope="module", params=["webdataset", "folder"])
def written(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a data set of seven images in three shards with lossless outputs."""
    folder: Path = tmp_path_factory.mktemp(request.param)
    write_all(folder, small_spec(format=request.param, encoding="exr"))
    return folder


def test_images_read_back_as_written(written: Path) -> None:
    alpha, count = written.name.startswith("folder"), 0
    for count, found in enumerate(dermis.read_dataset(written), start=1):  # noqa: B007
        truth = observation(found["number"], alpha)
        np.testing.assert_array_equal(found["picture"], truth.picture)
        for name in OUTPUT_NAMES:
            np.testing.assert_array_equal(found[name], truth.outputs[name])
            assert found[name].dtype == truth.outputs[name].dtype
        used = {name: value for name, value in found["parameters"].items() if value is not None}
        assert used == small_spec().parameters(found["number"])
    assert count == 7


def test_images_are_in_order_or_shuffled_by_a_seed_or_of_selected_shards(written: Path) -> None:
    def numbers(**options: Any) -> list[int]:
        return [one["number"] for one in dermis.read_dataset(written, **options)]

    assert numbers() == list(range(7))
    first, again, other = (numbers(shuffle=seed) for seed in (1, 1, 2))
    assert first == again != other and sorted(first) == sorted(other) == list(range(7))
    assert numbers(shards=[2, 0]) == [6, 0, 1, 2]
    (shard,) = written.glob("shard-00001*")
    assert [one["number"] for one in dermis.read_dataset(shard)] == [3, 4, 5]


def test_neither_pyarrow_nor_webdataset_is_needed_to_read(written: Path) -> None:
    code = (
        "import sys; sys.modules.update(dict.fromkeys(['pyarrow', 'webdataset', 'av'], None))\n"
        f"import dermis; assert len(list(dermis.read_dataset({str(written)!r}))) == 7"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_examples_of_the_documentation_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = small_spec(head={"yaw_deg": {"uniform": [-20, 20]}}, camera={"yaw_deg": {"uniform": [-40, 40]}})
    write_all(tmp_path / "faces", spec)
    write_index(tmp_path / "faces", spec)
    monkeypatch.chdir(tmp_path)
    reading, pipeline, raw, query = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    names: dict[str, Any] = {}
    exec(reading, names)
    assert names["points"].shape == (1, 2) and -20 <= names["turned"] <= 20
    exec(pipeline, names)
    found = sorted(names["images"], key=lambda one: one["number"])
    assert [one["number"] for one in found] == list(range(7))
    for one, ours in zip(found, dermis.read_dataset("faces"), strict=True):
        np.testing.assert_array_equal(one["depth"], ours["depth"])
        np.testing.assert_array_equal(one["picture"], ours["picture"])
    exec(raw, names)
    for picture, depth, record in names["pairs"]:
        seen = observation(record["number"])
        np.testing.assert_array_equal(picture, seen.picture)
        np.testing.assert_allclose(depth, seen.outputs["depth"], atol=0.0501)
    exec(query, names)
    drawn = [(k, spec.parameters(k)) for k in range(7)]
    turned = [k for k, one in drawn if abs(float(one["camera.yaw_deg"])) > 20]
    truth = [k for k in turned if image_split(spec, spec.parameters(k)) == "train"]
    assert names["profiles"] == [f"{k:09d}" for k in truth] and truth


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_webdataset_decodes_pictures_and_records_itself(tmp_path: Path) -> None:
    spec = small_spec(outputs=("depth",))
    write_all(tmp_path, spec)
    webdataset = import_extra("webdataset", "a test")
    shards = sorted(map(str, tmp_path.glob("shard-*.tar")))
    pipeline = webdataset.WebDataset(shards, shardshuffle=False).decode("rgb8")
    for one in pipeline.to_tuple("png", "json"):
        np.testing.assert_array_equal(one[0], observation(one[1]["number"]).picture)


def test_folders_without_shards_and_invalid_shards_are_refused(tmp_path: Path, written: Path) -> None:
    with pytest.raises(DermisError, match="it contains no shard"):
        dermis.read_dataset(tmp_path)
    with pytest.raises(DermisError, match="the folder of a data set, but it cannot be read"):
        dermis.read_dataset(tmp_path / "none")
    with pytest.raises(DermisError, match=r"numbers of the 3 shards in .* but got 3"):
        dermis.read_dataset(written, shards=[3])
    with pytest.raises(DermisError, match="a data set, but got a NoneType"):
        dermis.read_dataset(None)  # type: ignore[arg-type]
    with pytest.raises(DermisError, match="shuffle: expected a whole number"):
        dermis.read_dataset(written, shuffle="yes")  # type: ignore[arg-type]


def rewrite_shard(path: Path, change: Any) -> None:
    """Rewrite a shard with the members (name, bytes) that `change` returns."""
    with tarfile.open(path) as old:
        members = [(one.name, old.extractfile(one).read()) for one in old.getmembers()]  # type: ignore[union-attr]
    with tarfile.open(path, "w") as new:
        for name, data in change(members):
            head = tarfile.TarInfo(name)
            head.size = len(data)
            new.addfile(head, io.BytesIO(data))


def replace_member(name: str, data: bytes) -> Any:
    return lambda members: [(one, data if one == name else old_data) for one, old_data in members]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda members: members[:-1], "its end is missing"),
        (lambda members: [("../../evil.png", b""), *members], r"it contains '\.\./\.\./evil\.png'"),
        (lambda members: [("/etc/passwd", b""), *members], "it contains '/etc/passwd'"),
        (lambda members: [*members, members[0]], "two of its files have the same name"),
        (lambda members: [one for one in members if one[0] != "000000000.png"], r"its \.png is missing"),
        (lambda members: [one for one in members if one[0] != "000000000.json"], r"its \.json is missing"),
        (lambda members: [("000000000.picture.png", b""), *members], r"found \.picture\.png"),
        (lambda members: [("000000000.cls", b"1"), *members], r"found \.cls"),
        (replace_member("000000000.png", b"\x89PNG\r\n\x1a\n"), r"000000000\.png: .* cannot be decoded"),
        (replace_member("000000000.depth.png", b"GIF89a"), r"000000000\.depth\.png: .* cannot be decoded"),
        (replace_member("000000000.json", b"{}"), "a record of an image, but it cannot be understood"),
        (replace_member("000000000.json", b"[" * 9999), "nested too deeply"),
        (replace_member("000000000.json", b" " * (2 << 20)), "2,097,152 bytes"),
    ],
)
def test_damaged_tars_are_refused_by_name(tmp_path: Path, change: Any, message: str) -> None:
    write_all(tmp_path, small_spec(count=1, outputs=("depth",)))
    rewrite_shard(tmp_path / "shard-00000.tar", change)
    with pytest.raises(DermisError, match=rf"shard-00000\.tar.*{message}"):
        list(dermis.read_dataset(tmp_path))


def test_records_and_sizes_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    write_all(tmp_path, small_spec(count=1, outputs=("depth",)))
    path = tmp_path / "shard-00000.tar"
    with tarfile.open(path) as shard:
        record = json.loads(shard.extractfile("000000000.json").read())  # type: ignore[union-attr]

    def refused(message: str, **changes: Any) -> None:
        rewrite_shard(path, replace_member("000000000.json", json.dumps({**record, **changes}).encode()))
        with pytest.raises(DermisError, match=message):
            list(dermis.read_dataset(tmp_path))

    refused("the record of image 0, but got that of 5", number=5)
    refused("neither a number nor a text", parameters={"a": {"b": 1}})
    refused(r"an array has shape \(2, 2\), not \(3, 3\)", camera={**record["camera"], "K": [[1, 2], [3, 4]]})
    refused("texts in place of numbers", head_pose=[["1"] * 4] * 3)
    refused("neither true nor false", landmarks={"a": {"pixels": [], "positions_mm": [], "visible": [1]}})
    refused("cannot be understood", gaze=[[0, 0, 1], [0, 1]])
    small = encode_output("depth", np.ones((3, 4), np.float32), "png")
    rewrite_shard(path, replace_member("000000000.json", json.dumps(record).encode()))
    rewrite_shard(path, replace_member("000000000.depth.png", small))
    with pytest.raises(
        DermisError, match=r"outputs of the picture's size, but \.depth\.png has 4 x 3 pixels"
    ):
        list(dermis.read_dataset(tmp_path))


def test_links_and_folders_in_a_tar_are_refused(tmp_path: Path) -> None:
    with tarfile.open(tmp_path / "shard-00000.tar", "w") as shard:
        link = tarfile.TarInfo("000000000.png")
        link.type, link.linkname = tarfile.SYMTYPE, "/etc/passwd"
        shard.addfile(link)
    with pytest.raises(DermisError, match=r"'000000000\.png', which is not a regular file"):
        list(dermis.read_dataset(tmp_path))


def test_empty_landmark_sets_are_read() -> None:
    seen = observation(0)
    none = Landmarks(
        (), np.empty((0, 3), np.float32), np.empty((0, 2)), np.empty(0, bool), np.empty(0, np.uint8)
    )
    spec, seen = small_spec(), replace(seen, landmarks={"ibug-68": none})
    found = decode_image(encode_record(0, seen, spec.parameters(0), spec))["landmarks"]["ibug-68"]
    assert found.pixels.shape == (0, 2) and found.positions_mm.shape == (0, 3) and found.visible.shape == (0,)
