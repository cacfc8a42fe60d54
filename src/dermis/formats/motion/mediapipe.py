"""Captures of MediaPipe's face landmarker: one line of JSON per frame."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dermis.base import quantities
from dermis.base.arrays import Doubles, Intp
from dermis.base.errors import format_value, refuse
from dermis.base.reading import parse_json, read_text
from dermis.formats.motion.captures import (
    MAX_CLIP_BYTES,
    CaptureSamples,
    capture_clip,
    check_size,
    check_weights,
    find_rotation_bones,
    head_bone_angles,
    rotation_quaternions,
)
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head

_TIME_KEYS = {"time": 1.0, "time_s": 1.0, "timestamp_ms": 1e-3}
_SHAPE_KEYS = ("blendshapes", "face_blendshapes", "faceBlendshapes")
_MATRIX_KEYS = ("matrix", "facial_transformation_matrix", "facialTransformationMatrix")
_NEUTRAL_SCORE = "_neutral"  # score of the neutral face, not a blend shape
_MAX_TIME_MS = 1e15  # milliseconds
_MAX_MATRIX_VALUE = 1e6
_LINE_ADVICE = "Correct or remove the line"


class _CapturedFrame(NamedTuple):
    """Blend shape weights of one captured frame.

    line : line number in the file
    seconds : time of the frame [s]
    columns, weights : (n,) indices of the blend shapes of the frame, and their weights
    matrix : (4, 4) facial transformation; None if the frame has none
    """

    line: int
    seconds: float
    columns: Intp
    weights: Doubles
    matrix: Doubles | None


def load_mediapipe(path: Path, head: Head, fps: float | None = None) -> Clip:
    """Load lines of JSON with one frame each as a clip for a head.

    Each line has "time" [s] or "timestamp_ms", "blendshapes" as {name: score} or as MediaPipe's list of
    {"categoryName", "score"}, and optionally "matrix", the facial transformation (4, 4), which rotates the
    bones found by `find_rotation_bones`. Frames without blend shapes, in which no face was found, are
    skipped.

    fps : frame rate if the lines have no time

    Raises DermisError for a file without frames, and for invalid lines, which it names.
    """
    columns: dict[str, int] = {}
    rows = list(_captured_frames(path, fps, columns))
    if not rows:
        refuse(path, "lines of JSON with blend shapes", "there are none", "Record it again")
    _check_order(path, rows)
    names, weights = tuple(columns), np.zeros((len(rows), len(columns)))
    for index, row in enumerate(rows):
        weights[index, row.columns] = row.weights
    matrices = [row.matrix for row in rows if row.matrix is not None]
    bones = find_rotation_bones(head.control.skeleton)
    angles: dict[str, Doubles] = {}
    unused: tuple[str, ...] = ()
    if matrices and bones.head:
        angles = head_bone_angles(bones, rotation_quaternions(_fill_matrices(rows)))
    elif matrices:
        unused = ("matrix",)
    samples = CaptureSamples(np.array([row.seconds for row in rows]), names, weights, angles, unused)
    return capture_clip(path, path.stem, samples, head)


def _captured_frames(path: Path, fps: float | None, columns: dict[str, int]) -> Iterator[_CapturedFrame]:
    """Yield the frames in which a face was found, those with blend shapes.

    columns : column index by blend shape name; names that are not in it are added
    """
    count = 0
    for number, line in enumerate(io.StringIO(read_text(path, "lines of JSON", MAX_CLIP_BYTES)), start=1):
        if line.strip():
            row = _parse_frame(f"{path}, line {number}", number, line, fps, columns)
            count += len(row.columns) > 0
            check_size(path, count, len(columns))
            if len(row.columns):
                yield row


def _parse_frame(
    culprit: str, number: int, line: str, fps: float | None, columns: dict[str, int]
) -> _CapturedFrame:
    record = parse_json(line, culprit, "an object in JSON")
    if not isinstance(record, dict):
        refuse(culprit, "an object in JSON", f"got {line.strip():.40}", _LINE_ADVICE)
    shapes = next((record[key] for key in _SHAPE_KEYS if key in record), None)
    if shapes is None:
        actual = f"it has {', '.join(record) or 'nothing'}"
        refuse(culprit, "blendshapes", actual, _LINE_ADVICE)
    matrix = next((record[key] for key in _MATRIX_KEYS if record.get(key) is not None), None)
    seconds = _frame_seconds(culprit, number, record, fps)
    scores = _shape_scores(culprit, shapes)
    indices = np.array([columns.setdefault(name, len(columns)) for name in scores], np.intp)
    weights = np.fromiter(scores.values(), np.float64, len(scores))
    check_weights(culprit, list(scores), weights)
    return _CapturedFrame(
        number, seconds, indices, weights, None if matrix is None else _facial_transformation(culprit, matrix)
    )


def _frame_seconds(culprit: str, number: int, record: Mapping[str, object], fps: float | None) -> float:
    for key, scale in _TIME_KEYS.items():
        if key in record:
            return scale * quantities.checked_number(
                f"{culprit}: {key}", record[key], -_MAX_TIME_MS, _MAX_TIME_MS
            )
    if fps is None:
        refuse(culprit, f"a time ({', '.join(_TIME_KEYS)})", "it has none", "Set the frame rate (fps)")
    return (number - 1) / fps


def _shape_scores(culprit: str, shapes: object) -> dict[str, float]:
    """Return the score of each blend shape by name.

    shapes : {name: score}, or MediaPipe's list of {"categoryName", "score"}
    """
    if isinstance(shapes, list):
        categories = [item if isinstance(item, dict) else {} for item in shapes]
        names = [item.get("categoryName", item.get("category_name")) for item in categories]
        if None in names or any("score" not in item for item in categories):
            refuse(culprit, "a categoryName and a score for each blend shape", "one has none", _LINE_ADVICE)
        shapes = {str(name): item["score"] for name, item in zip(names, categories, strict=True)}
    if not isinstance(shapes, dict):
        refuse(culprit, "blendshapes by name or as a list", f"got {format_value(shapes)}", _LINE_ADVICE)
    for name, score in shapes.items():
        if type(score) not in (int, float):
            refuse(culprit, "scores as numbers", f"{name} is {format_value(score)}", _LINE_ADVICE)
    return {name: score for name, score in shapes.items() if name != _NEUTRAL_SCORE}


def _facial_transformation(culprit: str, value: object) -> Doubles:
    """Return a facial transformation (4, 4), which may be stored by rows or by columns, nested or flat.

    The column with the translation is the last one of the result.
    """
    flat = isinstance(value, list) and not any(isinstance(row, list) for row in value)
    shape = (16,) if flat else (4, 4)
    matrix = quantities.checked_array(
        f"{culprit}: matrix", value, shape, -_MAX_MATRIX_VALUE, _MAX_MATRIX_VALUE
    ).reshape(4, 4)
    if not abs(np.linalg.det(matrix[:3, :3])) > 1e-12:
        refuse(culprit, "an invertible matrix", "its determinant is 0", _LINE_ADVICE)
    return matrix.T if matrix[3, :3].any() and not matrix[:3, 3].any() else matrix


def _fill_matrices(rows: list[_CapturedFrame]) -> list[Doubles]:
    """Return the facial transformation of each frame; one without gets that of the nearest earlier frame.

    Frames before the first transformation get the first one.
    """
    last = next(row.matrix for row in rows if row.matrix is not None)
    matrices = []
    for row in rows:
        last = last if row.matrix is None else row.matrix
        matrices.append(last)
    return matrices


def _check_order(path: Path, rows: list[_CapturedFrame]) -> None:
    for before, after in pairwise(rows):
        if after.seconds < before.seconds:
            actual = f"{after.seconds:g} s comes after {before.seconds:g} s"
            refuse(f"{path}, line {after.line}", "increasing times", actual, "Sort the lines")
