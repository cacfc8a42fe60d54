"""Rigs of data sets: triangulation, rectified pairs, orbits, and calibrations of OpenCV."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_set import contents, drawn_here, write_spec

import dermis
from dermis.apps.batch.preview import dry_run
from dermis.apps.batch.rigs.calibration import load_calibrations, parse_opencv_yaml
from dermis.apps.batch.spec import Spec, parse_spec
from dermis.base.errors import DermisError

LENS = [-0.2, 0.05, 0.001, -0.002, 0.0]
STEREO_YAML = """%YAML:1.0
---
# stereo calibration
image_width: 64
image_height: 48
K1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 120., 0., 30.5, 0., 121., 22., 0., 0., 1. ]
D1: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -2.0e-01, 5.0e-02, 1.0e-03,
       -2.0e-03, 0. ]
K2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 118., 0., 33., 0., 118., 24., 0., 0., 1. ]
D2: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 0., 0., 0., 0., 0. ]
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]
T: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ -150., 0., 0. ]
"""


def spec_of(folder: Path, **values: Any) -> Spec:
    write_spec(folder)
    points = "".join(f"p{k},{20 * k}\n" for k in range(12))
    (folder / "points.csv").write_text(f"name,vertex\n{points}")
    table = tomllib.loads((folder / "spec.toml").read_text())
    return parse_spec(table | {"camera": {}, "outputs": ["depth"]} | values, folder)


def rendered(spec: Spec, out: Path) -> list[dict[str, Any]]:
    assert drawn_here(spec, out).is_complete
    return list(dermis.read_dataset(out))


def triangulated(images: list[dict[str, Any]]) -> np.ndarray[Any, Any]:
    """Return the points nearest to the rays of their pixels, by normal equations of the distances."""
    count = len(images[0]["landmarks"]["points.csv"].pixels)
    found = []
    for k in range(count):
        normal, right = np.zeros((3, 3)), np.zeros(3)
        for image in images:
            K, R, t = image["camera"]
            u, v = image["landmarks"]["points.csv"].pixels[k]
            ray = R.T @ [(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], 1.0]
            across = np.eye(3) - np.outer(ray, ray) / (ray @ ray)
            normal += across
            right += across @ (-R.T @ t)
        found.append(np.linalg.solve(normal, right))
    return np.array(found)


def test_landmarks_are_triangulated_from_a_stereo_pair(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, count=4, size=[160, 128], rig={"kind": "stereo", "baseline_mm": 600})
    images = rendered(spec, tmp_path / "out")
    for left, right in (images[:2], images[2:]):
        assert [one["parameters"]["rig.view"] for one in (left, right)] == [0, 1]
        points = left["landmarks"]["points.csv"].positions_mm
        np.testing.assert_array_equal(points, right["landmarks"]["points.csv"].positions_mm)
        assert np.abs(triangulated([left, right]) - points).max() < 0.01
        centres = [-one["camera"].R.T @ one["camera"].t for one in (left, right)]
        assert np.linalg.norm(centres[1] - centres[0]) == pytest.approx(600, abs=1e-3)
        assert (centres[1] - centres[0]) @ left["camera"].R[0] > 0
        shared = {name for name in left["parameters"] if name not in ("rig.view", "sensor.seed")}
        assert all(left["parameters"][name] == right["parameters"][name] for name in shared)
        for name, own in (("left", left), ("right", right)):
            for one in (left, right):
                for ours, theirs in zip(one["rig"][name], own["camera"], strict=True):
                    np.testing.assert_array_equal(ours, theirs)
    assert b"rig.view" in contents(tmp_path / "out")["index.parquet"]


def test_parallel_pairs_are_rectified(tmp_path: Path) -> None:
    rig = {"kind": "stereo", "baseline_mm": 80, "parallel": True}
    left, right = rendered(spec_of(tmp_path, count=2, size=[64, 64], rig=rig), tmp_path / "out")
    np.testing.assert_array_equal(left["camera"].R, right["camera"].R)
    np.testing.assert_array_equal(left["camera"].K, right["camera"].K)
    pixels = [one["landmarks"]["points.csv"].pixels for one in (left, right)]
    depths = (left["landmarks"]["points.csv"].positions_mm @ left["camera"].R.T + left["camera"].t)[:, 2]
    disparities = left["camera"].K[0, 0] * 80 / depths
    np.testing.assert_allclose(pixels[0] - pixels[1], np.stack([disparities, 0 * disparities], 1), atol=2e-3)


def test_an_orbit_surrounds_the_head(tmp_path: Path) -> None:
    rig = {"kind": "orbit", "count": 5, "arc_deg": 120}
    images = rendered(spec_of(tmp_path, count=5, rig=rig), tmp_path / "out")
    centres = np.array([-one["camera"].R.T @ one["camera"].t for one in images])
    yaws = np.degrees(np.arctan2(centres[:, 0], centres[:, 2]))
    np.testing.assert_allclose(np.diff(yaws), 30, atol=0.02)
    assert yaws[2] == pytest.approx(0, abs=0.5)
    assert np.ptp(np.hypot(centres[:, 0], centres[:, 2])) < 0.01 and np.ptp(centres[:, 1]) < 0.01
    assert np.abs(triangulated(images) - images[0]["landmarks"]["points.csv"].positions_mm).max() < 0.05
    assert list(images[0]["rig"]) == ["00", "01", "02", "03", "04"]
    assert all((one["depth"] > 0).any() for one in images)


def test_a_clip_of_a_rig_shows_each_frame_from_all_cameras(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, rig={"kind": "orbit", "count": 3}, clip={"frames": 4, "rate_hz": 10})
    assert spec.images_per_person == 12
    parameters = [spec.parameters(k) for k in range(12)]
    assert [one["rig.view"] for one in parameters] == [0] * 4 + [1] * 4 + [2] * 4
    assert [one["clip.frame"] for one in parameters] == [0, 1, 2, 3] * 3
    for k in range(8):
        later = {name: value for name, value in parameters[k + 4].items() if name != "rig.view"}
        assert later == {name: value for name, value in parameters[k].items() if name != "rig.view"}


def test_calibrations_with_distortion_are_those_of_the_pictures(tmp_path: Path) -> None:
    """Landmarks are at the pixels of OpenCV's formula for the numbers in the file, scaled to the pictures."""
    turn = np.radians(20)
    R = [[np.cos(turn), 0, -np.sin(turn)], [0, -1, 0], [-np.sin(turn), 0, -np.cos(turn)]]
    K = [[300.0, 0, 70.0], [0, 310.0, 55.0], [0, 0, 1]]
    cameras = [
        {"name": "a", "K": K, "dist": LENS, "R": R, "t": [4.0, -3.0, 700.0], "size": [128, 96]},
        {
            "name": "b",
            "K": K,
            "R": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
            "t": [0, 0, 0.8e3],
            "size": [128, 96],
        },
    ]
    (tmp_path / "rig.json").write_text(json.dumps({"cameras": cameras}))
    rig = {"kind": "file", "file": "rig.json"}
    tables = {"rig": rig, "sensor": {}, "lens": {}, "outputs": ["depth", "position"]}
    spec = spec_of(tmp_path, count=2, size=[64, 48], **tables)
    assert "rig.json" in spec.files
    images = rendered(spec, tmp_path / "out")
    for image, camera in zip(images, cameras, strict=True):
        k1, k2, p1, p2, k3 = camera.get("dist", [0.0] * 5)  # type: ignore[misc]
        assert [image["parameters"][f"lens.{name}"] for name in ("k1", "p2")] == [k1, p2]
        expected = []
        for point in image["landmarks"]["points.csv"].positions_mm:
            X, Y, Z = np.array(camera["R"]) @ point + camera["t"]
            x, y = X / Z, Y / Z
            r2 = x * x + y * y
            radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
            u = 300.0 * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + 70.0
            v = 310.0 * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + 55.0
            expected.append([(u + 0.5) / 2 - 0.5, (v + 0.5) / 2 - 0.5])
        np.testing.assert_allclose(image["landmarks"]["points.csv"].pixels, expected, atol=3e-3)
        seen = image["depth"] > 0
        y_seen, x_seen = np.nonzero(seen)
        in_camera = image["position"][seen] @ image["camera"].R.T + image["camera"].t
        plane = in_camera[:, :2] / in_camera[:, 2:]
        lens = dermis.dataset.Lens(k1=k1, k2=k2, p1=p1, p2=p2, k3=k3)
        pixels = lens.distort(plane) * np.diag(image["camera"].K)[:2] + image["camera"].K[:2, 2]
        errors = np.linalg.norm(pixels - np.stack([x_seen, y_seen], 1), axis=1)
        assert np.median(errors) < 0.05 and len(errors) > 100


def test_stereo_calibrations_of_opencv_are_read_and_placed(tmp_path: Path) -> None:
    (tmp_path / "stereo.yml").write_text(STEREO_YAML.replace("data: [ -2.0e-01", "data: [ 0.0e-01"))
    first, second = load_calibrations(tmp_path / "stereo.yml")
    assert (first.name, second.name, first.size) == ("left", "right", (64, 48))
    assert first.K.tolist() == [[120, 0, 30.5], [0, 121, 22], [0, 0, 1]]
    assert first.lens.k2 == 0.05 and first.lens.p2 == -0.002 and not any(second.lens.model_dump().values())
    assert second.t.tolist() == [-150, 0, 0]
    text = STEREO_YAML.replace("-2.0e-01, 5.0e-02, 1.0e-03,\n       -2.0e-03", "0., 0., 0., 0.")
    (tmp_path / "stereo.yml").write_text(text)
    rig = {"kind": "file", "file": "stereo.yml", "anchor": "first", "unit_mm": 2.0}
    left, right = rendered(spec_of(tmp_path, count=2, size=[64, 48], rig=rig), tmp_path / "out")
    np.testing.assert_allclose(right["camera"].t - left["camera"].t, [-300, 0, 0], atol=1e-3)
    np.testing.assert_allclose(left["camera"].K, [[120, 0, 30.5], [0, 121, 22], [0, 0, 1]], atol=1e-3)
    assert (left["depth"] > 0).any() and np.linalg.norm(left["camera"].t) == pytest.approx(1100, abs=60)


def test_lists_of_cameras_in_yaml_are_read() -> None:
    text = "cameras:\n- name: a\n  K: [[1, 0, 2],\n    [0, 1, 2], [0, 0, 1.]]\n  size: [4, 4]\n- name: b\n"
    assert parse_opencv_yaml(text)["cameras"][""][0]["K"] == [[1, 0, 2], [0, 1, 2], [0, 0, 1.0]]
    assert [one["name"] for one in parse_opencv_yaml(text)["cameras"][""]] == ["a", "b"]
    with pytest.raises(DermisError, match="line 1: expected key: value"):
        parse_opencv_yaml("{a: 1}\n")


@pytest.mark.parametrize(
    ("rig", "message"),
    [
        ({"kind": "stereo", "count": 3}, 'rig: count: expected kind = "orbit"'),
        ({"kind": "file"}, "rig: file: expected the name of a file"),
        ({"kind": "file", "file": "rig.json"}, "a table \\[lens\\] for lenses with distortion"),
        ({"kind": "file", "file": "wrong.json"}, "camera 0: R: expected a rotation matrix"),
        ({"kind": "file", "file": "none.json"}, "none.json"),
        ({"kind": "file", "file": "near.json"}, '0 mm from it.*anchor = "first"'),
    ],
)
def test_invalid_rigs_are_refused(rig: dict[str, Any], message: str, tmp_path: Path) -> None:
    K, eye = [[90.0, 0, 31.5], [0, 90.0, 31.5], [0, 0, 1]], np.eye(3).tolist()
    two = [{"K": K, "R": eye, "t": [0, 0, 900], "size": [64, 64], "dist": LENS}] * 2
    (tmp_path / "rig.json").write_text(json.dumps({"cameras": two}))
    near = [{**one, "name": name, "t": [0, 0, 0], "dist": []} for name, one in zip("ab", two, strict=True)]
    (tmp_path / "near.json").write_text(json.dumps({"cameras": near}))
    wrong = [{**one, "R": (2 * np.eye(3)).tolist()} for one in two]
    (tmp_path / "wrong.json").write_text(json.dumps({"cameras": wrong}))
    with pytest.raises(DermisError, match=message):
        parse_spec({"rig": rig}, tmp_path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dist": "none"}, "camera 0: dist: expected a list of numbers, but got 'none'"),
        ({"dist": [[0.1, 0], [0]]}, "camera 0: dist: expected a list of numbers"),
        ({"t": [[1, 2], [3]]}, "camera 0: t: expected a list of numbers"),
        ({"size": [64, "high"]}, "camera 0: size: expected a list of numbers"),
        ({"K": {"rows": "three", "cols": 3, "data": [1]}}, "K: expected a list of numbers"),
        (
            {"dist": [0.1, 0, 0, 0], "distortion_model": "equidistant"},
            "distortion_model: expected one of plumb_bob",
        ),
        ({"name": 1}, "a different name for each camera"),
        ({"K": None}, "K: expected the intrinsic matrix"),
    ],
)
def test_damaged_cameras_are_refused(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    good = {"K": [[90.0, 0, 31.5], [0, 90.0, 31.5], [0, 0, 1]], "R": np.eye(3).tolist()}
    good |= {"t": [0, 0, 900], "size": [64, 64]}
    (tmp_path / "rig.json").write_text(json.dumps({"cameras": [good | change, good, good]}))
    with pytest.raises(DermisError, match=message):
        load_calibrations(tmp_path / "rig.json")


def test_entries_that_are_no_cameras_are_refused(tmp_path: Path) -> None:
    (tmp_path / "rig.json").write_text(json.dumps({"cameras": [3, 4]}))
    with pytest.raises(DermisError, match="camera 0: camera: expected a table"):
        load_calibrations(tmp_path / "rig.json")


def test_without_the_table_specs_are_unchanged() -> None:
    plain = parse_spec({"seed": 3})
    assert "[rig]" not in plain.to_toml() and not any("rig." in name for name in plain.parameter_names)
    rig = parse_spec({"seed": 3, "rig": {"kind": "orbit", "count": 3}})
    for number in range(9):  # the moments are the images without the rig
        shared = {k: v for k, v in rig.parameters(number).items() if not k.startswith("rig.")}
        assert shared == plain.parameters(number // 3)


def test_the_preview_shows_frames_of_clips_from_each_camera(tmp_path: Path) -> None:
    tables = {"rig": {"kind": "orbit", "count": 3}, "clip": {"frames": 8, "flow": True}}
    spec = spec_of(tmp_path, count=24, **tables)
    rows, sheet, estimate = dry_run(spec, "cpu")
    assert sheet.shape == (3 * 192 + 2 * 4, 4 * 192 + 3 * 4, 3)  # four frames from each of three cameras
    views = [sheet[k * 196 : k * 196 + 192, :192].astype(int) for k in range(3)]
    assert np.abs(views[0] - views[1]).max() > 20
    assert estimate["bytes"] > 24 * 1000 and {row["parameter"] for row in rows} >= {"rig.view", "clip.frame"}
