"""Captures of Live Link Face and MediaPipe: their values, and errors that name invalid lines."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from captured_head import HEAD, captured_head
from scipy.spatial.transform import Rotation

import dermis
from dermis.base.errors import DermisError, DermisWarning

COLUMNS = "Timecode,BlendShapeCount,EyeBlinkLeft,JawOpen,TongueOut"
COLUMNS += ",HeadYaw,HeadPitch,HeadRoll,LeftEyeYaw,LeftEyePitch,LeftEyeRoll"


def _csv(path: Path, *rows: str, header: str = COLUMNS) -> Path:
    path.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    return path


ROWS = (
    "10:59:59:58.500,61,0.1,0.2,0.9,0.2,0.1,0,0.05,0.1,0",
    "10:59:59:59.500,61,0.3,0.4,0.9,0.4,0.1,0,0.05,0.1,0",
    "11:00:00:00.500,61,0.5,0.8,0.9,0.6,0.1,0,0.05,0.1,0",
)


def test_live_link_rows_are_read(tmp_path: Path) -> None:
    clip = dermis.load_motion(_csv(tmp_path / "take.csv", *ROWS), HEAD)
    assert clip.name == "take" and clip.rate == 60.0 and clip.duration_s == pytest.approx(2 / 60)
    assert clip.targets == ("eyeBlinkLeft", "jawOpen") and set(clip.bones) == {"neck", "head", "LeftEye"}
    assert clip.left_out == ("TongueOut",) and "TongueOut" in clip.note
    pose = clip.pose_at(0.5 / 60)
    assert pose.weights == pytest.approx({"eyeBlinkLeft": 0.2, "jawOpen": 0.3})
    np.testing.assert_allclose(pose.bones["LeftEye"], np.degrees([0.1, 0.05, 0]))
    pose_arrays = clip.pose_at(2 / 60).to_arrays(HEAD.control_rig)
    expected = Rotation.from_euler("zxy", [0, 0.1, 0.6]).as_matrix()
    np.testing.assert_allclose(pose_arrays.matrices[2, :, :3], expected, atol=1e-5)


def test_columns_are_identified_by_name(tmp_path: Path) -> None:
    plain = dermis.load_motion(_csv(tmp_path / "a.csv", *ROWS), HEAD).pose_at(0.01)
    order = np.random.default_rng(0).permutation(11)
    turned = [",".join(np.array(row.split(","))[order]) for row in (COLUMNS.upper(), *ROWS)]
    other = dermis.load_motion(_csv(tmp_path / "b.csv", *turned[1:], header=turned[0]), HEAD).pose_at(0.01)
    assert dict(other.weights) == dict(plain.weights) and set(other.bones) == set(plain.bones)
    for name in plain.bones:
        np.testing.assert_array_equal(other.bones[name], plain.bones[name])


def test_windows_line_ends_and_byte_order_mark_are_accepted(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(b"\xef\xbb\xbf" + "\r\n".join([COLUMNS, *ROWS, "", ""]).encode())
    assert dermis.load_motion(path, HEAD).rate == 60.0


def test_head_without_bones_notes_unused_rotations(tmp_path: Path) -> None:
    clip = dermis.load_motion(_csv(tmp_path / "a.csv", *ROWS), captured_head())
    assert clip.bones == () and clip.pose_at(0.0).bones == {}
    assert {"HeadYaw", "HeadPitch", "LeftEyeYaw"} <= set(clip.left_out)


@pytest.mark.parametrize(
    ("frames", "fps"), [((23, 0), 24.0), ((29, 0), 30.0), ((58.2, 0), 60.0), ((119, 0), 120.0)]
)
def test_frame_rate_follows_from_the_timecode(
    tmp_path: Path, frames: tuple[float, float], fps: float
) -> None:
    rows = [f"01:02:0{k}:{frame},0,0.5" for k, frame in enumerate(frames)]
    clip = dermis.load_motion(
        _csv(tmp_path / "a.csv", *rows, header="Timecode,BlendShapeCount,JawOpen"), HEAD
    )
    assert clip.duration_s == pytest.approx(1 - frames[0] / fps)


def test_short_take_defaults_to_sixty_fps_unless_fps_is_given(tmp_path: Path) -> None:
    path = _csv(tmp_path / "a.csv", "01:00:00:03,0,1", "01:00:00:06,0,1", header="Timecode,,JawOpen")
    assert dermis.load_motion(path, HEAD).duration_s == pytest.approx(3 / 60)
    assert dermis.load_motion(path, HEAD, fps=30).duration_s == pytest.approx(3 / 30)


def test_midnight_does_not_reverse_time(tmp_path: Path) -> None:
    rows = ("23:59:59:59,0,0", "00:00:00:00,0,1")
    clip = dermis.load_motion(
        _csv(tmp_path / "a.csv", *rows, header="Timecode,BlendShapeCount,JawOpen"), HEAD
    )
    assert clip.duration_s == pytest.approx(1 / 60)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ((), r"a\.csv: .*only its header"),
        ((ROWS[0], ROWS[1][:-6]), r"a\.csv, line 3: expected 11 cells, but got 9"),
        ((ROWS[0], ROWS[1] + ",7"), r"a\.csv, line 3: expected 11 cells, but got 12"),
        ((ROWS[0], "", ROWS[1].replace("0.4", "much")), r"a\.csv, line 4: .*JawOpen is 'much'"),
        ((ROWS[0], ROWS[1].replace("0.3", "inf")), r"line 3: .*EyeBlinkLeft is inf"),
        ((ROWS[1], ROWS[0]), r"a\.csv, line 3: .*increasing Timecodes, .* 0\.017 s before"),
        (("noon" + ROWS[0],), r"a\.csv, line 2: .*HH:MM:SS:FF\.fff, but got 'noon10"),
    ],
)
def test_broken_line_numbers_are_reported(tmp_path: Path, rows: tuple[str, ...], words: str) -> None:
    with pytest.raises(DermisError, match=words):
        dermis.load_motion(_csv(tmp_path / "a.csv", *rows), HEAD)


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("Timecode,BlendShapeCount", r"line 1: expected columns of blend shapes"),
        ("Timecode,JawOpen,jawopen", r"line 1: expected each column once, but JawOpen occurs twice"),
        (
            "Timecode,Leg",
            r"a\.csv: expected names of targets or bones of the head, but it has Leg and the head jawOpen",
        ),
    ],
)
def test_other_headers_are_refused(tmp_path: Path, header: str, words: str) -> None:
    row = ",".join(["00:00:00:00", "0", "0"][: header.count(",") + 1])
    with pytest.raises(DermisError, match=words):
        dermis.load_motion(_csv(tmp_path / "a.csv", row, header=header), HEAD)


def test_empty_and_missing_files_are_refused(tmp_path: Path) -> None:
    for name, content in (("a.csv", ""), ("a.jsonl", "\n\n")):
        (tmp_path / name).write_text(content)
        with pytest.raises(DermisError, match=rf"{name}: .*(empty|there are none)"):
            dermis.load_motion(tmp_path / name, HEAD)
        with pytest.raises(DermisError, match="there is no such file"):
            dermis.load_motion(tmp_path / f"no{name}", HEAD)
    (tmp_path / "a.txt").write_text("")
    with pytest.raises(DermisError, match=r"the suffix is '\.txt'"):
        dermis.load_motion(tmp_path / "a.txt", HEAD)
    with pytest.raises(DermisError, match="fps: expected"):
        dermis.load_motion(tmp_path / "a.csv", HEAD, fps=0)


def _lines(path: Path, *rows: object) -> Path:
    path.write_text("\n".join(row if isinstance(row, str) else json.dumps(row) for row in rows))
    return path


def _matrix(turn: Rotation) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), (1, 2, -40)
    return matrix


@pytest.mark.parametrize("form", ["rows", "flat", "columns"])
def test_mediapipe_lines_are_read(tmp_path: Path, form: str) -> None:
    turns = Rotation.from_euler("zxy", [[5, -10, 20], [0, 0, 40]], degrees=True)
    forms = {
        "rows": lambda m: m.tolist(),
        "flat": lambda m: m.ravel().tolist(),
        "columns": lambda m: m.T.tolist(),
    }
    listed = [{"categoryName": "_neutral", "score": 1e-6}, {"categoryName": "jawOpen", "score": 0.6}]
    path = _lines(
        tmp_path / "face.jsonl",
        {
            "timestamp_ms": 1000,
            "blendshapes": {"jawOpen": 0.2, "tongueOut": 0.1},
            "matrix": forms[form](_matrix(turns[0])),
        },
        {"timestamp_ms": 1020, "blendshapes": []},  # no face was found
        {"timestamp_ms": 1040, "blendshapes": listed, "matrix": forms[form](_matrix(turns[1]))},
    )
    with pytest.warns(DermisWarning, match="1 of 3 frames show no face; their pose is interpolated"):
        clip = dermis.load_motion(path, HEAD)
    assert clip.duration_s == pytest.approx(0.04) and clip.rate == 50.0
    assert clip.targets == ("jawOpen",) and clip.left_out == ("tongueOut",)
    assert clip.pose_at(0.02).weights["jawOpen"] == pytest.approx(0.4)
    for seconds, turn in zip((0.0, 0.04), turns, strict=True):
        pose_arrays = clip.pose_at(seconds).to_arrays(HEAD.control_rig)
        np.testing.assert_allclose(pose_arrays.matrices[2, :, :3], turn.as_matrix(), atol=1e-5)


def test_lines_without_time_use_the_frame_rate(tmp_path: Path) -> None:
    path = _lines(tmp_path / "face.jsonl", *({"blendshapes": {"jawOpen": k / 4}} for k in range(5)))
    clip = dermis.load_motion(path, HEAD, fps=10)
    assert clip.duration_s == pytest.approx(0.4) and clip.rate == pytest.approx(10.0)
    assert clip.pose_at(0.15).weights["jawOpen"] == pytest.approx(0.375)
    with pytest.warns(DermisWarning, match=r"face\.jsonl: it has no times; 30 frames per second are assumed"):
        assert dermis.load_motion(path, HEAD).duration_s == pytest.approx(4 / 30)


GOOD = {"time": 0.0, "blendshapes": {"jawOpen": 0.1}}


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (
            '{"time": 0.1, "blend',
            r"a\.jsonl, line 2: expected results of MediaPipe .*Unterminated string",
        ),
        ("7", r"line 2: expected an object in JSON, but got 7"),
        ("[1, 2]", r"line 2: expected a categoryName and a score for each blend shape"),
        ({"time": "soon", "blendshapes": {}}, r"line 2: time: expected a number .*got 'soon'"),
        ({"time": 0.1, "blendshapes": 7}, r"line 2: expected blendshapes by name"),
        (
            {"time": 0.1, "blendshapes": {"jawOpen": "x"}},
            r"line 2: expected scores as numbers, but jawOpen is 'x'",
        ),
        ('{"time": 0.1, "blendshapes": {"jawOpen": NaN}}', r"line 2: .*NaN is not a number"),
        ({"time": 0.1, "blendshapes": [{"score": 1}]}, r"line 2: expected a categoryName"),
        (
            {"time": -0.1, "blendshapes": {"jawOpen": 0}},
            r"line 2: expected increasing times, but -0\.1 s comes",
        ),
        (GOOD | {"matrix": [1, 2]}, r"line 2: matrix: expected 16 numbers"),
        (GOOD | {"matrix": np.zeros((4, 4)).tolist()}, r"line 2: expected an invertible matrix"),
    ],
)
def test_broken_json_reports_its_line(tmp_path: Path, row: object, words: str) -> None:
    with pytest.raises(DermisError, match=words):
        dermis.load_motion(_lines(tmp_path / "a.jsonl", GOOD, row), HEAD)


def test_invalid_time_is_refused(tmp_path: Path) -> None:
    clip = dermis.load_motion(_lines(tmp_path / "a.jsonl", GOOD), HEAD)
    assert clip.duration_s == 0.0 and clip.rate is None and clip.frame_count(30) == 1
    for seconds in (float("nan"), float("inf")):
        with pytest.raises(DermisError, match="a: time: expected a number"):
            clip.pose_at(seconds)
    with pytest.raises(DermisError, match=r"rate: expected a number from 0\.001"):
        clip.frame_count(0)
