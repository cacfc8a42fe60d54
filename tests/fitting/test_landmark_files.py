"""Landmarks in a photograph in the forms that annotators and detectors write."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.apps.inverse.fitting.inputs import fit_subject
from dermis.apps.inverse.fitting.landmark_files import read_landmarks
from dermis.apps.inverse.fitting.placement import align_to_landmarks
from dermis.base.errors import DermisError, DermisWarning
from dermis.human.landmarks.points import landmark_points
from dermis.human.person import Human
from dermis.scene.camera import Camera

SIZE = (300, 400)
POINTS = np.random.default_rng(4).uniform(100, 200, (68, 2)).round(3)
HEADS = {"plain": "", "comment": "# by hand\n", "mark": "\ufeff"}
PTS = "version: 1\nn_points:  68\n{\n"
DETECTED = np.array([(120.0, 150.0), (180.0, 150.0), (150.0, 190.0), (125.0, 220.0), (175.0, 220.0)])
"""Eyes, nose and corners of the mouth as MTCNN and RetinaFace order them."""
EYE_CORNERS = np.array([(190.0, 150.0), (165.0, 152.0), (110.0, 150.0), (135.0, 152.0), (150.0, 200.0)])
"""dlib's five points."""
FIVE = "five landmarks place the camera, but say little about the shape of the face"


def _read(path: Path, text: str, *notes: str) -> tuple[str, dict[str, NDArray[np.float64]]]:
    """Read a file, which must issue exactly these notes."""
    path.write_text(text, "utf-8")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = read_landmarks(path, SIZE)
    assert [str(one.message) for one in caught] == [f"{path}: {note}" for note in notes]
    return found


def _lines(points: NDArray[np.float64], form: str = "{x},{y}", start: int = 0) -> str:
    rows = enumerate(points.tolist(), start)
    return "".join(form.format(k=k, x=x, y=y) + "\n" for k, (x, y) in rows)


def _check_points(found: tuple[str, dict[str, NDArray[np.float64]]], offset: float = 0.0) -> None:
    name, pixels = found
    assert name == "ibug-68" and list(pixels) == [str(k) for k in range(68)]
    np.testing.assert_allclose(list(pixels.values()), POINTS + offset, atol=1e-6)


@pytest.mark.parametrize("form", ["{x},{y}", "{x}, {y}", "{x};{y}", "{x}\t{y}", "{x} {y}", "  {x}   {y}"])
@pytest.mark.parametrize("head", HEADS.values(), ids=HEADS)
def test_rows_without_a_header_are_read(tmp_path: Path, head: str, form: str) -> None:
    _check_points(_read(tmp_path / "face.csv", head + _lines(POINTS, form)))


@pytest.mark.parametrize("form", ["{k},{x},{y}", "{k};{x};{y}", "{k} {x} {y}"])
@pytest.mark.parametrize("start", [0, 1])
def test_rows_with_a_leading_index_are_read(tmp_path: Path, form: str, start: int) -> None:
    notes = ["its landmarks are numbered from 1; they are taken as those from 0"] * start
    _check_points(_read(tmp_path / "face.csv", _lines(POINTS, form, start), *notes))


@pytest.mark.parametrize("header", ["name,x,y", "Index,X,Y", "landmark, x, y", "id,x,y", ",x,y"])
@pytest.mark.parametrize("start", [0, 1])
def test_header_with_names_is_read(tmp_path: Path, header: str, start: int) -> None:
    notes = ["its landmarks are numbered from 1; they are taken as those from 0"] * start
    text = f"{header}\n" + _lines(POINTS, "{k},{x},{y}", start)
    _check_points(_read(tmp_path / "face.csv", text, *notes))


def test_decimal_commas_with_semicolons_are_read(tmp_path: Path) -> None:
    _check_points(_read(tmp_path / "face.csv", _lines(POINTS, "{x};{y}").replace(".", ",")))


def test_all_coordinates_in_one_line_are_read(tmp_path: Path) -> None:
    _check_points(_read(tmp_path / "face.txt", " ".join(map(str, POINTS.ravel().tolist()))))


def test_openface_row_is_read(tmp_path: Path) -> None:
    header = ["frame", "confidence", *(f"{axis}_{k}" for axis in "xyXY" for k in range(68))]
    row = [1, 0.98, *POINTS.T.ravel().tolist(), *[7.0] * 136]
    rows = [", ".join(map(str, one)) for one in (header, row, row)]
    _check_points(_read(tmp_path / "face.csv", "\n".join(rows), "the first of its 2 rows is used"))


def test_other_columns_are_noted(tmp_path: Path) -> None:
    text = "name,x,y,score\n" + _lines(POINTS, "{k},{x},{y},0.9")
    _check_points(_read(tmp_path / "face.csv", text, "its columns score are not used"))
    note = "of its 3 columns those from 3 on are not used"
    _check_points(_read(tmp_path / "face.csv", _lines(POINTS, "{x},{y},-4.5"), note))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (PTS, "}\n"),
        (PTS.replace("\n", "\r\n"), "}"),
        ("VERSION : 1\nn_points:68\n{ \n", "}\n\n"),
        ("{\n", "}"),
    ],
)
def test_pts_files_count_from_one(tmp_path: Path, before: str, after: str) -> None:
    _check_points(_read(tmp_path / "face.pts", before + _lines(POINTS, "{x} {y} ") + after), -1.0)


def test_a_pts_file_must_have_as_many_points_as_it_states(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match=r"face\.pts: expected 68 points as it states, but got 67"):
        _read(tmp_path / "face.pts", PTS + _lines(POINTS[1:], "{x} {y}") + "}")


def test_sets_without_jaw_outline_are_read(tmp_path: Path) -> None:
    name, pixels = _read(tmp_path / "face.csv", _lines(POINTS[17:]))
    assert name == "ibug-68" and list(pixels)[::50] == ["17", "67"]


@pytest.mark.parametrize(
    ("points", "order", "names", "set_name"),
    [
        (DETECTED, (0, 1, 2, 3, 4), "68 69 30 48 54", "face-synthetics-70"),
        (DETECTED, (1, 0, 2, 4, 3), "69 68 30 54 48", "face-synthetics-70"),
        (EYE_CORNERS, (0, 1, 2, 3, 4), "45 42 36 39 33", "ibug-68"),
        (EYE_CORNERS, (2, 3, 0, 1, 4), "36 39 45 42 33", "ibug-68"),
    ],
)
def test_five_points_are_identified_by_arrangement(
    tmp_path: Path, points: NDArray[np.float64], order: tuple[int, ...], names: str, set_name: str
) -> None:
    for turn in (0.0, 0.5, -0.5):
        matrix = np.array([(np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn))])
        turned = (points - 150) @ matrix + 150
        name, pixels = _read(tmp_path / "face.csv", _lines(turned[list(order)]), FIVE)
        assert name == set_name and list(pixels) == names.split()
        np.testing.assert_allclose(list(pixels.values()), turned[list(order)])


@pytest.mark.parametrize("count", [4, 21, 98, 106])
def test_unknown_counts_are_refused_with_known_ones_listed(tmp_path: Path, count: int) -> None:
    with pytest.raises(DermisError, match=rf"a known set \(5, 51, 68, 70, 468, 478\), .*, but got {count}"):
        _read(tmp_path / "face.csv", _lines(np.resize(POINTS, (count, 2))))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "it is empty"),
        ("landmark,u,v\nnose,1,2\n", "its columns are landmark, u, v"),
        ("name,x,y\n" + _lines(POINTS, "p{k},{x},{y}"), "numbers from 0 to 67 as names .* got 'p0'"),
        ("name,x,y\n" + _lines(POINTS, "3,{x},{y}"), "numbers from 0 to 67 as names .* got '3'"),
        (_lines(POINTS * 20), r"in the photograph, of 300 x 400 pixels, but their middle is at"),
        (_lines(POINTS, "{x},here"), "cannot be understood|its columns are"),
        ("[]", "no face was found"),
        ('{"faceLandmarks": []}', "no face was found"),
        ('{"faceLandmarks": "none"}', "no face was found"),
        ('{"landmarks": {}}', "no face was found"),
        ('{"image": 3}', "no face was found"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(DermisError, match=rf"face\.txt: expected .*{words}"):
        _read(tmp_path / "face.txt", text)


def test_missing_positions_are_counted(tmp_path: Path) -> None:
    rows = _lines(POINTS).splitlines()
    rows[5] = rows[8] = "nan,nan"
    name, pixels = _read(tmp_path / "face.csv", "\n".join(rows), "2 of 68 landmarks have no position")
    assert name == "ibug-68" and len(pixels) == 66 and "5" not in pixels


FACE = [{"x": 0.5, "y": k / 478, "z": 0.0} for k in range(478)]


@pytest.mark.parametrize(
    "data",
    [
        {"face_landmarks": [FACE]},
        {"faceLandmarks": [FACE], "faceBlendshapes": []},
        {"multi_face_landmarks": [{"landmark": FACE}]},
        {"faceLandmarks": {"value": [FACE]}},
        {"faceLandmarks": [{"landmarks": FACE}]},
        [FACE],
        FACE,
    ],
)
def test_mediapipe_landmarks_are_read(tmp_path: Path, data: object) -> None:
    name, pixels = _read(tmp_path / "face.json", json.dumps(data))
    assert name == "mediapipe" and pixels["239"] == pytest.approx([149.5, 199.5])


def test_json_numbers_are_pixels_or_relative_coordinates(tmp_path: Path) -> None:
    _check_points(_read(tmp_path / "face.json", json.dumps(POINTS.tolist())))
    relative = ((POINTS + 0.5) / SIZE).tolist()
    note = "its coordinates are taken as relative to the size of the photograph"
    _check_points(_read(tmp_path / "face.json", json.dumps({"landmarks": [relative]}), note))
    _check_points(_read(tmp_path / "face.csv", _lines(np.array(relative)), note))


def test_first_of_several_faces_is_used_with_a_note(tmp_path: Path) -> None:
    _read(tmp_path / "face.json", json.dumps([FACE, FACE]), "the first of its 2 faces is used")


def test_five_points_determine_the_camera(tmp_path: Path) -> None:
    person = Human()
    head, truth = person.head(subdivide=0), Camera(position=(250.0, 20.0, 1100.0), frame_mm=300.0)
    points = landmark_points(head, "face-synthetics-70")
    positions = np.einsum("nk,nkc->nc", points.weight, head.positions_mm[points.point]) - head.centre_mm
    camera = truth.to_opencv(SIZE)
    seen = (positions[[68, 69, 30, 48, 54]] @ camera.R.T + camera.t) @ camera.K.T
    (tmp_path / "face.txt").write_text(_lines(seen[:, :2] / seen[:, 2:], "{x} {y}"))
    subject = fit_subject(person)
    subject = replace(subject, person=None, scene=replace(subject.scene, head=head))
    with pytest.warns(DermisWarning, match=FIVE):
        fitted = align_to_landmarks(subject, tmp_path / "face.txt", SIZE).scene.camera
    towards, true = (np.subtract(one.position, one.target) for one in (fitted, truth))
    cosine = towards @ true / np.linalg.norm(towards) / np.linalg.norm(true)
    assert np.degrees(np.arccos(cosine)) < 3.0
