"""Captures in the forms that programs write: results of MediaPipe's APIs, tables of Live Link Face."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from captured_head import HEAD, captured_head
from scipy.spatial.transform import Rotation

import dermis
from dermis.base.errors import DermisError
from dermis.mesh.clip import Clip

TURN = Rotation.from_euler("zxy", [5, -10, 25], degrees=True)
MATRIX = np.eye(4)
MATRIX[:3, :3], MATRIX[:3, 3] = TURN.as_matrix(), (1, 2, -40)
WEIGHTS = (0.0, 0.25, 0.5)
Record = dict[str, Any]


def _snake(weight: float) -> list[Record]:
    values = {"_neutral": 1e-6, "jawOpen": weight, "eyeBlinkLeft": 0.125}
    rows = enumerate(values.items())
    return [{"index": k, "score": s, "display_name": "", "category_name": n} for k, (n, s) in rows]


def _camel(weight: float) -> list[Record]:
    keys = {"display_name": "displayName", "category_name": "categoryName"}
    return [{keys.get(key, key): value for key, value in item.items()} for item in _snake(weight)]


def _python(weight: float) -> Record:
    """Return a result as dataclasses.asdict makes it, with matrices as nested lists."""
    face = {"face_landmarks": [[{"x": 0.5, "y": 0.5, "z": 0.0}]], "face_blendshapes": [_snake(weight)]}
    return face | {"facial_transformation_matrixes": [MATRIX.tolist()]}


def _protobuf(weight: float) -> Record:
    """Return messages as MessageToDict makes them."""
    listed = [{"index": 0, "score": weight, "label": "jawOpen"}, {"score": 0.125, "label": "eyeBlinkLeft"}]
    matrix = {"rows": 4, "cols": 4, "packedData": MATRIX.T.ravel().tolist()}
    return {"faceBlendshapes": [{"classification": listed}], "facialTransformationMatrixes": [matrix]}


def _javascript(weight: float) -> Record:
    matrix = {"rows": 4, "columns": 4, "data": MATRIX.T.ravel().tolist()}
    shapes = {"categories": _camel(weight), "headIndex": -1, "headName": ""}
    return {"faceLandmarks": [], "faceBlendshapes": [shapes], "facialTransformationMatrixes": [matrix]}


def _typed_array(weight: float) -> Record:
    data = {str(k): value for k, value in enumerate(MATRIX.T.ravel().tolist())}
    matrix = {"rows": 4, "columns": 4, "data": data}
    return _javascript(weight) | {"facialTransformationMatrixes": [matrix]}


def _android(weight: float) -> Record:
    shapes, matrices = [_camel(weight)], [MATRIX.T.ravel().tolist()]
    return {"faceBlendshapes": shapes, "facialTransformationMatrixes": matrices}


def _optional(weight: float) -> Record:
    """Return Android's lists as Gson writes an Optional."""
    return {key: {"value": value} for key, value in _android(weight).items()}


def _within(weight: float) -> Record:
    return {"source": "camera", "result": _javascript(weight)}


def _faces(weight: float) -> Record:
    return {"faces": [{"blendshapes": {"jawOpen": weight, "eyeBlinkLeft": 0.125}, "matrix": MATRIX.tolist()}]}


def _pairs(weight: float) -> Record:
    listed = [{"name": "jawOpen", "value": weight}, {"name": "eyeBlinkLeft", "value": 0.125}]
    return {"blendshapes": listed, "matrix": MATRIX.ravel().tolist()}


FORMS = [_python, _protobuf, _javascript, _typed_array, _android, _optional, _within, _faces, _pairs]
Form = Callable[[float], Record]


def _file(folder: Path, text: object) -> Path:
    path = folder / "face.json"
    path.write_text(text if isinstance(text, str) else json.dumps(text), "utf-8")
    return path


def _load(path: Path, *notes: str, fps: float | None = None) -> Clip:
    """Load a motion, which must issue exactly these notes."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        clip = dermis.load_motion(path, HEAD, fps=fps)
    assert [str(one.message) for one in caught] == [f"{path}: {note}" for note in notes]
    return clip


def _check_motion(clip: Clip) -> None:
    assert clip.duration_s == pytest.approx(0.066)
    assert clip.pose_at(0.0495).weights == pytest.approx({"jawOpen": 0.375, "eyeBlinkLeft": 0.125})
    turned = clip.pose_at(0.0).to_arrays(HEAD.control_rig).matrices[2, :, :3]
    np.testing.assert_allclose(turned, TURN.as_matrix(), atol=1e-5)


def _records(form: Form) -> list[Record]:
    return [{"timestamp_ms": 33 * k} | form(weight) for k, weight in enumerate(WEIGHTS)]


@pytest.mark.parametrize("form", FORMS)
def test_results_of_each_api_are_read(tmp_path: Path, form: Form) -> None:
    _check_motion(_load(_file(tmp_path, "\n".join(map(json.dumps, _records(form))))))


@pytest.mark.parametrize(
    "document",
    [
        lambda rows: json.dumps(rows),
        lambda rows: json.dumps(rows, indent=2),
        lambda rows: json.dumps(
            {"model": "face_landmarker", "shape_names": ["jawOpen"], "frames": rows}, indent=1
        ),
        lambda rows: "[\n" + ",\n".join(map(json.dumps, rows)) + "\n]",
        lambda rows: "\ufeff" + "\r\n".join(map(json.dumps, rows)),
    ],
    ids=["list", "indented list", "object with a list", "list with one per line", "lines of Windows"],
)
def test_results_in_each_document_type_are_read(
    tmp_path: Path, document: Callable[[list[Record]], str]
) -> None:
    _check_motion(_load(_file(tmp_path, document(_records(_javascript)))))


def test_utf_16_lines_of_windows_redirection_are_read(tmp_path: Path) -> None:
    path = tmp_path / "face.jsonl"
    path.write_bytes("\r\n".join(map(json.dumps, _records(_python))).encode("utf-16"))
    _check_motion(_load(path))


def test_javascript_result_is_read(sample_folder: Path) -> None:
    clip = _load(sample_folder / "field" / "motion" / "n02_js_result.jsonl")
    assert clip.rate == 30.0
    turned = clip.pose_at(0.5).to_arrays(HEAD.control_rig).matrices[2, :, :3]
    angles = Rotation.from_matrix(turned).as_euler("zxy", degrees=True)
    assert angles == pytest.approx([0.0, 0.0, 22.92], abs=0.01)


@pytest.mark.parametrize("lost", [[], None, [[]], [{"categories": []}], {"value": []}, {}])
def test_frames_without_a_face_are_interpolated_and_counted(tmp_path: Path, lost: object) -> None:
    rows = _records(_javascript)
    faceless = {"faceLandmarks": [], "faceBlendshapes": lost, "facialTransformationMatrixes": []}
    rows = [{"timestamp_ms": -33} | faceless, rows[0], {"timestamp_ms": 33} | faceless, rows[2], faceless]
    rows[-1]["timestamp_ms"] = 99
    clip = _load(_file(tmp_path, rows), "3 of 5 frames show no face; their pose is interpolated")
    assert clip.duration_s == pytest.approx(0.132)
    jaw = [clip.pose_at(0.033 * k).weights["jawOpen"] for k in range(5)]
    assert jaw == pytest.approx([0.0, 0.0, 0.25, 0.5, 0.5])


def test_a_file_without_any_face_says_how_to_record(tmp_path: Path) -> None:
    path = _file(tmp_path, [{"face_landmarks": [[{"x": 0, "y": 0}]], "face_blendshapes": []}])
    with pytest.raises(DermisError, match=r"no frame has any .*face_landmarks.* output_face_blendshapes"):
        dermis.load_motion(path, HEAD)


def test_first_of_several_faces_is_used_with_a_note(tmp_path: Path) -> None:
    rows = _records(_android)
    rows[1]["faceBlendshapes"].append(_camel(1.0))
    _check_motion(_load(_file(tmp_path, rows), "1 of 3 frames show several faces; the first one is used"))


def test_matrix_alone_rotates_the_head(tmp_path: Path) -> None:
    rows = _records(_javascript)
    clip = _load(_file(tmp_path, [row | {"faceBlendshapes": []} for row in rows]))
    assert clip.targets == () and clip.bones == ("neck", "head")


def test_a_missing_matrix_is_interpolated_with_a_note(tmp_path: Path) -> None:
    rows = _records(_python)
    del rows[1]["facial_transformation_matrixes"]
    _check_motion(
        _load(_file(tmp_path, rows), "1 of 3 frames have no matrix; the turn of the head is interpolated")
    )


def test_rotation_without_translation_is_read_in_api_order(tmp_path: Path) -> None:
    pure = np.eye(4)
    pure[:3, :3] = TURN.as_matrix()
    for stored in ([pure.T.ravel().tolist()], [pure.tolist()], pure.ravel().tolist(), pure.tolist()):
        path = _file(tmp_path, [{"time": 0, "matrix": stored, "blendshapes": {"jawOpen": 0}}])
        turned = _load(path).pose_at(0.0).to_arrays(HEAD.control_rig).matrices[2, :, :3]
        np.testing.assert_allclose(turned, TURN.as_matrix(), atol=1e-5)


def test_matrix_for_a_head_without_bones_is_noted(tmp_path: Path) -> None:
    clip = dermis.load_motion(_file(tmp_path, _records(_python)), captured_head())
    assert clip.note == "face: the head has no bone for the matrix; left out."


@pytest.mark.parametrize(
    ("key", "step", "note"),
    [
        ("time", 0.033, None),
        ("time_s", 0.033, None),
        ("timestampMs", 33, None),
        ("timestampInMilliseconds", 33, None),
        ("timestamp_us", 33_000, None),
        ("timestamp", 0.033, "seconds"),
        ("timestamp", 33, "milliseconds"),
        ("timestamp", 33_000, "microseconds"),
        ("timestamp", 33_000_000, "nanoseconds"),
    ],
)
def test_times_are_found_by_name_or_by_step(tmp_path: Path, key: str, step: float, note: str | None) -> None:
    rows = [{key: 5 * step + k * step} | _android(weight) for k, weight in enumerate(WEIGHTS)]
    notes = [f"the unit of its times is not stated; they are taken as {note}"] if note else []
    _check_motion(_load(_file(tmp_path, rows), *notes))


def test_a_missing_time_is_interpolated_with_a_note(tmp_path: Path) -> None:
    rows = _records(_python)
    del rows[1]["timestamp_ms"]
    _check_motion(_load(_file(tmp_path, rows), "1 of 3 frames have no time; it is interpolated"))


def test_missing_times_use_the_file_rate_or_thirty_fps(tmp_path: Path) -> None:
    rows = [_python(weight) for weight in WEIGHTS]
    path = _file(tmp_path, {"fps": 25, "frames": rows})
    assert _load(path).duration_s == pytest.approx(2 / 25)
    assert _load(path, fps=50).duration_s == pytest.approx(2 / 50)
    note = "it has no times; 30 frames per second are assumed, which fps (--motion-fps) changes"
    assert _load(_file(tmp_path, rows), note).duration_s == pytest.approx(2 / 30)
    numbered = [{"frame": 10 * k} | row for k, row in enumerate(rows)]
    assert _load(_file(tmp_path, numbered), note).duration_s == pytest.approx(20 / 30)


def test_scores_in_percent_are_recognised(tmp_path: Path) -> None:
    rows = [
        {"time": 0.033 * k, "blendshapes": {"jawOpen": 100 * w, "eyeBlinkLeft": 12.5}}
        for k, w in enumerate(WEIGHTS)
    ]
    clip = _load(_file(tmp_path, rows), "weights of up to 50 are taken as percent")
    assert clip.pose_at(0.066).weights == pytest.approx({"jawOpen": 0.5, "eyeBlinkLeft": 0.125})


def test_large_weights_are_kept_with_a_note(tmp_path: Path) -> None:
    path = _file(tmp_path, [{"time": 0.0, "blendshapes": {"jawOpen": 7}}])
    clip = _load(path, "weights of up to 7 are used as they are, where 1 is the full shape")
    assert clip.pose_at(0.0).weights == {"jawOpen": 7.0}


HEADER = "Timecode,BlendShapeCount,JawOpen,EyeBlinkLeft,HeadYaw,HeadPitch,HeadRoll"
ROWS = [f"10:00:00:0{k}.000,61,{w},0.125,0.4,0.1,0.05" for k, w in enumerate(WEIGHTS)]


def _csv(folder: Path, *lines: str) -> Path:
    path = folder / "take.csv"
    path.write_text("\n".join(lines), "utf-8")
    return path


def _check_take(clip: Clip, rate: float = 60.0) -> None:
    assert clip.duration_s == pytest.approx(2 / rate)
    pose = clip.pose_at(1.5 / rate)
    assert pose.weights == pytest.approx({"jawOpen": 0.375, "eyeBlinkLeft": 0.125})
    np.testing.assert_allclose(pose.bones["head"], clip.pose_at(0.0).bones["head"], atol=1e-9)
    turned = pose.to_arrays(HEAD.control_rig).matrices[2, :, :3]
    expected = Rotation.from_euler("zxy", [0.05, 0.1, 0.4]).as_matrix()
    np.testing.assert_allclose(turned, expected, atol=1e-5)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text,
        lambda text: text.replace(",", ";"),
        lambda text: text.replace(",", "\t"),
        lambda text: text.replace(",", ";").replace(".", ","),
        lambda text: text.replace(",", "\t").replace(".", ","),
        lambda text: ",".join(f'"{cell}"' for cell in text.split(",")).replace(".", ","),
        lambda text: text.replace("Timecode", "\ufeffTimecode"),
        lambda text: text.replace("HeadYaw", "Head Yaw").replace("Timecode", "Time Code"),
    ],
    ids=["plain", "semicolons", "tabs", "decimal commas", "tabs and commas", "quotes", "mark", "spaces"],
)
def test_separators_and_decimal_commas(tmp_path: Path, change: Callable[[str], str]) -> None:
    _check_take(_load(_csv(tmp_path, *map(change, (HEADER, *ROWS)))))


@pytest.mark.parametrize("cell", ["", " ", "nan", "NaN"])
def test_empty_cells_are_interpolated_and_counted(tmp_path: Path, cell: str) -> None:
    rows = [ROWS[0], ROWS[1].replace("0.25", cell), ROWS[2].replace("0.125", cell)]
    _check_take(
        _load(_csv(tmp_path, HEADER, *rows), "2 empty cells are interpolated between those of other frames")
    )


@pytest.mark.parametrize("cells", ["0,,,,,", "0,0,0,0,0,0", "61,0.0,0,0,0,0", "0", "61,,,,,"])
def test_rows_without_a_tracked_face_are_interpolated_and_counted(tmp_path: Path, cells: str) -> None:
    lost = f"10:00:00:01.000,{cells}"
    _check_take(
        _load(
            _csv(tmp_path, HEADER, ROWS[0], lost, ROWS[2]),
            "1 of 3 frames show no face; their pose is interpolated",
        )
    )


def test_neutral_pose_counts_as_tracked_face(tmp_path: Path) -> None:
    header, rows = (
        "Timecode,BlendShapeCount,JawOpen",
        ["10:00:00:00,1,0.5", "10:00:00:01,1,0", "10:00:00:02,1,0.5"],
    )
    assert _load(_csv(tmp_path, header, *rows)).pose_at(1 / 60).weights == pytest.approx(
        {"jawOpen": 0.0}, abs=1e-6
    )


def test_a_table_without_a_face_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="expected frames with a face, but all rows are empty"):
        dermis.load_motion(_csv(tmp_path, HEADER, "10:00:00:00,0,,,,,"), HEAD)


def test_columns_without_values_are_left_out_with_a_note(tmp_path: Path) -> None:
    rows = [f"{row}," for row in ROWS]
    _check_take(
        _load(_csv(tmp_path, f"{HEADER},TongueOut", *rows), "columns without values are left out: TongueOut")
    )


def test_weights_in_percent_and_angles_in_degrees_are_converted(tmp_path: Path) -> None:
    yaw, pitch, roll = np.degrees([0.4, 0.1, 0.05])
    rows = [f"10:00:00:0{k}.000,61,{100 * w},12.5,{yaw},{pitch},{roll}" for k, w in enumerate(WEIGHTS)]
    notes = "weights of up to 50 are taken as percent", "its angles are taken as degrees"
    _check_take(_load(_csv(tmp_path, HEADER, *rows), *notes))


@pytest.mark.parametrize(
    ("column", "times", "note"),
    [
        ("TimeCode", ["10:00:00.000", "10:00:00.033", "10:00:00.066"], None),
        ("time", ["0.5", "0.533", "0.566"], None),
        ("timestamp_ms", ["0", "33", "66"], None),
        (
            "Timecode",
            ["1.000", "1.033", "1.066"],
            "the unit of its times is not stated; they are taken as seconds",
        ),
        (
            "Frame",
            ["10", "12", "14"],
            "it has no times; 60 frames per second are assumed, which fps (--motion-fps) changes",
        ),
        (
            "",
            ["", "", ""],
            "it has no times; 60 frames per second are assumed, which fps (--motion-fps) changes",
        ),
    ],
)
def test_time_columns_are_recognised(tmp_path: Path, column: str, times: list[str], note: str | None) -> None:
    rows = [f"{time},{row.partition(',')[2]}" for time, row in zip(times, ROWS, strict=True)]
    rate = 60 if not column else 30 if column == "Frame" else 2 / 0.066
    _check_take(_load(_csv(tmp_path, HEADER.replace("Timecode", column), *rows), *[note] * bool(note)), rate)


def test_invalid_time_is_named_in_the_error(tmp_path: Path) -> None:
    for time in ("noon", "inf", ""):
        rows = f"{time},61,0.5,0,0,0,0"
        with pytest.raises(DermisError, match=r"take\.csv, line 2: expected a "):
            dermis.load_motion(_csv(tmp_path, HEADER, rows), HEAD)
