"""Captures of MediaPipe's face landmarker: a line of JSON for each frame."""

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

_SECONDS = {"time": 1.0, "time_s": 1.0, "timestamp_ms": 1e-3}
_SHAPES = ("blendshapes", "face_blendshapes", "faceBlendshapes")
_MATRIX = ("matrix", "facial_transformation_matrix", "facialTransformationMatrix")
_NEUTRAL = "_neutral"  # what is left when nothing else is there: not a shape
_MAX_TIME = 1e15  # milliseconds of a clock; frames count from the first
_MAX_MATRIX_VALUE = 1e6
_ADVICE = "Correct or remove the line"


class _Row(NamedTuple):
    """A frame: weights (k,) of some columns (k,)."""

    line: int
    seconds: float
    columns: Intp
    weights: Doubles
    matrix: Doubles | None


def load_mediapipe(path: Path, head: Head, fps: float | None = None) -> Clip:
    """The clip that lines of JSON are for a head, one object a frame.

    Each has "time" [s] or "timestamp_ms", "blendshapes" as {name: score} or as MediaPipe's own list of
    {"categoryName", "score"}, and perhaps "matrix", the facial transformation (4, 4), whose rotation turns
    the bones that `find_rotation_bones` tells. A frame without blend shapes, in which no face was found, counts
    for nothing.

    fps : frames a second where the lines have no time

    Raises DermisError for a file without frames and for broken lines, which it names.
    """
    columns: dict[str, int] = {}
    rows = list(_rows(path, fps, columns))
    if not rows:
        refuse(path, "lines of JSON with blend shapes", "there are none", "Record it again")
    _check_order(path, rows)
    names, weights = tuple(columns), np.zeros((len(rows), len(columns)))
    for place, row in enumerate(rows):
        weights[place, row.columns] = row.weights
    matrices = [row.matrix for row in rows if row.matrix is not None]
    bones = find_rotation_bones(head.control.skeleton)
    angles: dict[str, Doubles] = {}
    lost: tuple[str, ...] = ()
    if matrices and bones.head:
        angles = head_bone_angles(bones, rotation_quaternions(_fill_matrices(rows)))
    elif matrices:
        lost = ("matrix",)
    samples = CaptureSamples(np.array([row.seconds for row in rows]), names, weights, angles, lost)
    return capture_clip(path, path.stem, samples, head)


def _rows(path: Path, fps: float | None, columns: dict[str, int]) -> Iterator[_Row]:
    """Frames that have blend shapes.

    columns : by name of a blend shape; new names are added
    """
    count = 0
    for number, line in enumerate(io.StringIO(read_text(path, "lines of JSON", MAX_CLIP_BYTES)), start=1):
        if line.strip():
            row = _row(f"{path}, line {number}", number, line, fps, columns)
            count += len(row.columns) > 0
            check_size(path, count, len(columns))
            if len(row.columns):
                yield row


def _row(culprit: str, number: int, line: str, fps: float | None, columns: dict[str, int]) -> _Row:
    told = parse_json(line, culprit, "an object in JSON")
    if not isinstance(told, dict):
        refuse(culprit, "an object in JSON", f"got {line.strip():.40}", _ADVICE)
    shapes = next((told[key] for key in _SHAPES if key in told), None)
    if shapes is None:
        actual = f"it has {', '.join(told) or 'nothing'}"
        refuse(culprit, "blendshapes", actual, _ADVICE)
    matrix = next((told[key] for key in _MATRIX if told.get(key) is not None), None)
    seconds = _seconds(culprit, number, told, fps)
    scores = _scores(culprit, shapes)
    places = np.array([columns.setdefault(name, len(columns)) for name in scores], np.intp)
    weights = np.fromiter(scores.values(), np.float64, len(scores))
    check_weights(culprit, list(scores), weights)
    return _Row(number, seconds, places, weights, None if matrix is None else _matrix(culprit, matrix))


def _seconds(culprit: str, number: int, told: Mapping[str, object], fps: float | None) -> float:
    for key, scale in _SECONDS.items():
        if key in told:
            return scale * quantities.checked_number(f"{culprit}: {key}", told[key], -_MAX_TIME, _MAX_TIME)
    if fps is None:
        refuse(culprit, f"a time ({', '.join(_SECONDS)})", "it has none", "Give the frames a second (fps)")
    return (number - 1) / fps


def _scores(culprit: str, shapes: object) -> dict[str, float]:
    """Scores by name, from either form."""
    if isinstance(shapes, list):
        categories = [one if isinstance(one, dict) else {} for one in shapes]
        names = [one.get("categoryName", one.get("category_name")) for one in categories]
        if None in names or any("score" not in one for one in categories):
            refuse(culprit, "a categoryName and a score for each blend shape", "one has none", _ADVICE)
        shapes = {str(name): one["score"] for name, one in zip(names, categories, strict=True)}
    if not isinstance(shapes, dict):
        refuse(culprit, "blendshapes by name or as a list", f"got {format_value(shapes)}", _ADVICE)
    for name, score in shapes.items():
        if type(score) not in (int, float):
            refuse(culprit, "scores as numbers", f"{name} is {format_value(score)}", _ADVICE)
    return {name: score for name, score in shapes.items() if name != _NEUTRAL}


def _matrix(culprit: str, given: object) -> Doubles:
    """(4, 4) with the translation in its last column, from rows or columns."""
    flat = isinstance(given, list) and not any(isinstance(one, list) for one in given)
    shape = (16,) if flat else (4, 4)
    matrix = quantities.checked_array(
        f"{culprit}: matrix", given, shape, -_MAX_MATRIX_VALUE, _MAX_MATRIX_VALUE
    ).reshape(4, 4)
    if not abs(np.linalg.det(matrix[:3, :3])) > 1e-12:
        refuse(culprit, "a matrix that turns", "this one is flat", _ADVICE)
    return matrix.T if matrix[3, :3].any() and not matrix[:3, 3].any() else matrix


def _fill_matrices(rows: list[_Row]) -> list[Doubles]:
    """A matrix for each row: where it has none, the last one before it, or the first of all."""
    last = next(row.matrix for row in rows if row.matrix is not None)
    found = []
    for row in rows:
        last = last if row.matrix is None else row.matrix
        found.append(last)
    return found


def _check_order(path: Path, rows: list[_Row]) -> None:
    for before, after in pairwise(rows):
        if after.seconds < before.seconds:
            actual = f"{after.seconds:g} s comes after {before.seconds:g} s"
            refuse(f"{path}, line {after.line}", "times that go on", actual, "Sort the lines")
