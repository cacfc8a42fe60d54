"""Images as arrays, the endless stream, and exports of keypoints."""

from __future__ import annotations

import itertools
import json
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_observation import SIZE, observation, small_spec, write_all
from small_set import read, write_spec

import dermis.dataset
from dermis.apps.batch import keypoint_files
from dermis.apps.batch.datasheet import write_datasheet
from dermis.apps.batch.index import write_index
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.stream import _image_numbers
from dermis.base.errors import DermisError


def first(spec: Spec, count: int, **options: Any) -> list[dict[str, Any]]:
    images = dermis.dataset.stream(spec, adapter="cpu", **options)
    found = list(itertools.islice(images, count))
    images.close()  # type: ignore[attr-defined]
    return found


def test_streamed_images_are_those_of_the_data_set(
    small_folder: Path, small_spec: Spec, undisturbed: dict[str, bytes]
) -> None:
    """Except for the quantisation of outputs in files."""
    written = itertools.islice(dermis.read_dataset(small_folder / "undisturbed"), 6)
    for ours, theirs in zip(first(small_spec, 6), map(dermis.dataset.arrays, written), strict=True):
        assert list(ours) == list(theirs)
        for name in ours:
            assert (ours[name].dtype, ours[name].shape) == (theirs[name].dtype, theirs[name].shape), name
            if name in ("depth", "normal"):
                assert np.abs(ours[name] - theirs[name]).max() <= (0.0501 if name == "depth" else 2e-5)
            else:
                np.testing.assert_array_equal(ours[name], theirs[name], name)


def test_a_stream_does_not_end_at_the_count_and_its_keys_are_fixed(small_spec: Spec) -> None:
    found = first(small_spec.replace(count=2), 5, first=1, step=3)
    assert [int(one["number"]) for one in found] == [1, 4, 7, 10, 13]
    kinds = [{name: (value.dtype, value.shape) for name, value in one.items()} for one in found]
    assert all(one == kinds[0] for one in kinds)
    assert all(value.flags.writeable for value in found[0].values())
    names = dermis.dataset.parameter_names(small_spec)
    assert found[0]["parameters"].shape == (len(names),)
    yaw = found[2]["parameters"][names.index("camera.yaw_deg")]
    assert yaw == pytest.approx(float(small_spec.parameters(7)["camera.yaw_deg"]), rel=1e-5)


def test_workers_of_a_stream_share_the_people() -> None:
    shares = [list(itertools.islice(_image_numbers(k, 2, 3), 6)) for k in range(2)]
    assert shares == [[0, 1, 2, 6, 7, 8], [3, 4, 5, 9, 10, 11]]


def test_the_thread_of_a_stream_ends(small_spec: Spec, tmp_path: Path) -> None:
    first(small_spec, 1)
    assert not [one for one in threading.enumerate() if one.name == "dermis stream"]
    bad = read(write_spec(tmp_path, "bad.obj"))
    with pytest.raises(DermisError, match=r"bad\.obj"):
        first(bad, 20)
    with pytest.raises(DermisError, match="prefetch"):
        dermis.dataset.stream(small_spec, prefetch=0)


def test_arrays_mark_what_an_image_does_not_have() -> None:
    image = {"camera": observation(2).camera, "head_pose": np.eye(3, 4), "gaze": None, "landmarks": {}}
    image |= {"number": 2, "parameters": {"a": None, "b": 2}, "picture": np.zeros((3, 4, 4), np.uint8)}
    found = dermis.dataset.arrays(image)
    assert np.isnan(found["gaze"]).all() and np.isnan(found["box.face"]).all()
    assert found["split"] == -1 and found["parameters"][1] == 2 and np.isnan(found["parameters"][0])
    assert found["picture"].shape == (3, 4, 3) and (found["picture_alpha"] == 0).all()


@pytest.fixture(scope="module")
def faces(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("keypoints") / "faces"
    spec = small_spec(outputs=())
    write_all(folder, spec)
    write_index(folder, spec)
    write_datasheet(folder, spec)
    return folder


def test_coco_files_have_the_keypoints_of_the_records(faces: Path, tmp_path: Path) -> None:
    out = dermis.dataset.export_keypoints(faces, tmp_path / "coco", "coco")
    images = {one["number"]: one for one in dermis.read_dataset(faces)}
    seen = 0
    for path in (out / "annotations").glob("*.json"):
        content = json.loads(path.read_text())
        split = path.stem.removeprefix("face_keypoints_")
        assert len(content["categories"][0]["keypoints"]) == 68 and content["licenses"][0]["name"]
        for image, annotation in zip(content["images"], content["annotations"], strict=True):
            truth = images[image["id"] - 1]
            points, flags = truth["landmarks"]["ibug-68"], np.array(annotation["keypoints"]).reshape(-1, 3)
            inside = (points.pixels > -0.5).all(axis=1) & (points.pixels < np.array(SIZE) - 0.5).all(axis=1)
            expected = np.where(points.visible & (points.occlusion < 2), 2, 1) * inside
            assert flags[:, 2].tolist() == expected.tolist() and truth["split"] == split
            np.testing.assert_allclose(flags[inside, :2], points.pixels[inside], atol=1e-3)
            assert (out / split / image["file_name"]).is_file() and (image["width"], image["height"]) == SIZE
            seen += 1
    assert seen == 7


def test_landmarks_that_a_lens_does_not_image_are_unlabelled(
    faces: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    decode = keypoint_files.record_fields

    def without_first_landmark(*given: Any) -> Any:
        fields = decode(*given)
        fields["landmarks"]["ibug-68"].pixels[0] = np.nan
        return fields

    monkeypatch.setattr(keypoint_files, "record_fields", without_first_landmark)
    out = dermis.dataset.export_keypoints(faces, tmp_path / "coco", "coco")
    for path in (out / "annotations").glob("*.json"):
        for annotation in json.loads(path.read_text())["annotations"]:
            assert annotation["keypoints"][:3] == [0, 0, 0] and np.isfinite(annotation["bbox"]).all()
    with pytest.raises(DermisError, match="coco"):
        dermis.dataset.export_keypoints(faces, tmp_path / "pts", "pts")


def test_pts_files_count_from_one(faces: Path, tmp_path: Path) -> None:
    out = dermis.dataset.export_keypoints(faces, tmp_path / "pts", "pts")
    for image in dermis.read_dataset(faces):
        text = (out / image["split"] / f"{image['number']:09d}.pts").read_text()
        assert text.startswith("version: 1\nn_points: 2\n{\n") and text.endswith("}\n")
        rows = np.array(text.split("{")[1].split("}")[0].split(), float).reshape(-1, 2)
        np.testing.assert_allclose(rows - 1, image["landmarks"]["ibug-68"].pixels, atol=1e-3)
    with pytest.raises(DermisError, match="a folder that does not exist"):
        dermis.dataset.export_keypoints(faces, out, "pts")
    with pytest.raises(DermisError, match="one of ibug-68"):
        dermis.dataset.export_keypoints(faces, tmp_path / "other", "pts", "mediapipe")
    assert sorted(one.name for one in tmp_path.iterdir()) == ["pts"], "nothing is left of a refused export"
