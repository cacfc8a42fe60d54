"""Captures of MediaPipe's face landmarker: a line of JSON for each frame."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.mesh.head import Head
from dermis.scene.clips.clip import Clip
from dermis.scene.clips.sampled import Samples, check_weight, sampled_clip
from dermis.scene.clips.turning import head_turns, matrix_turns, turning_bones

Doubles = NDArray[np.float64]

_SECONDS = {"time": 1.0, "time_s": 1.0, "timestamp_ms": 1e-3}
_SHAPES = ("blendshapes", "face_blendshapes", "faceBlendshapes")
_MATRIX = ("matrix", "facial_transformation_matrix", "facialTransformationMatrix")
_NEUTRAL = "_neutral"  # what is left when nothing else is there: not a shape
_MEND = "Correct or remove the line"


class _Row(NamedTuple):
    line: int
    seconds: float
    weights: dict[str, float]
    matrix: Doubles | None


def load_mediapipe(path: Path, head: Head, fps: float | None = None) -> Clip:
    """The clip that lines of JSON are for a head, one object a frame.

    Each has "time" [s] or "timestamp_ms", "blendshapes" as {name: score} or as MediaPipe's own list of
    {"categoryName", "score"}, and perhaps "matrix", the facial transformation (4, 4), whose rotation turns
    the bones that `turning_bones` tells. A frame without blend shapes, in which no face was found, counts
    for nothing.

    fps : frames a second where the lines have no time

    Raises DermisError for a file without frames and for broken lines, which it names.
    """
    rows = [row for row in _rows(path, fps) if row.weights]
    if not rows:
        refuse(path, "lines of JSON with blend shapes", "there are none", "Record it again")
    _check_order(path, rows)
    names = tuple(dict.fromkeys(name for row in rows for name in row.weights))
    weights = np.array([[row.weights.get(name, 0.0) for name in names] for row in rows])
    matrices = [row.matrix for row in rows if row.matrix is not None]
    bones = turning_bones(head.control.skeleton)
    angles: dict[str, Doubles] = {}
    lost: tuple[str, ...] = ()
    if matrices and bones.head:
        angles = head_turns(bones, matrix_turns(_filled(rows)))
    elif matrices:
        lost = ("matrix",)
    samples = Samples(np.array([row.seconds for row in rows]), names, weights, angles, lost)
    return sampled_clip(path, path.stem, samples, head)


def _rows(path: Path, fps: float | None) -> Iterator[_Row]:
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as fault:
        refuse(path, "lines of JSON", f"it cannot be read ({fault})", "Check the file")
    for number, line in enumerate(lines, start=1):
        if line.strip():
            yield _row(f"{path}, line {number}", number, line, fps)


def _row(culprit: str, number: int, line: str, fps: float | None) -> _Row:
    try:
        told = json.loads(line)
    except json.JSONDecodeError as fault:
        refuse(culprit, "an object in JSON", f"{fault.msg} at letter {fault.pos + 1}", _MEND)
    if not isinstance(told, dict):
        refuse(culprit, "an object in JSON", f"{line.strip():.40} came", _MEND)
    shapes = next((told[key] for key in _SHAPES if key in told), None)
    if shapes is None:
        came = f"it has {', '.join(told) or 'nothing'}"
        refuse(culprit, "blendshapes", came, _MEND)
    matrix = next((told[key] for key in _MATRIX if told.get(key) is not None), None)
    seconds = _seconds(culprit, number, told, fps)
    return _Row(
        number, seconds, _weights(culprit, shapes), None if matrix is None else _matrix(culprit, matrix)
    )


def _seconds(culprit: str, number: int, told: Mapping[str, Any], fps: float | None) -> float:
    for key, scale in _SECONDS.items():
        if key in told:
            if not isinstance(told[key], int | float) or not math.isfinite(told[key]):
                refuse(culprit, f"{key} as a number", f"{told[key]!r} came", _MEND)
            return float(told[key]) * scale
    if fps is None:
        refuse(culprit, f"a time ({', '.join(_SECONDS)})", "it has none", "Give the frames a second (fps)")
    return (number - 1) / fps


def _weights(culprit: str, shapes: Any) -> dict[str, float]:
    """Scores by name, from either form."""
    if isinstance(shapes, list):
        categories = [one if isinstance(one, dict) else {} for one in shapes]
        names = [one.get("categoryName", one.get("category_name")) for one in categories]
        if None in names or any("score" not in one for one in categories):
            refuse(culprit, "a categoryName and a score for each blend shape", "one has none", _MEND)
        shapes = {str(name): one["score"] for name, one in zip(names, categories, strict=True)}
    if not isinstance(shapes, dict):
        refuse(culprit, "blendshapes by name or as a list", f"{shapes!r:.40} came", _MEND)
    for name, score in shapes.items():
        if not isinstance(score, int | float):
            refuse(culprit, "scores as numbers", f"{name} is {score!r}", _MEND)
    return {name: check_weight(culprit, name, float(s)) for name, s in shapes.items() if name != _NEUTRAL}


def _matrix(culprit: str, given: Any) -> Doubles:
    """(4, 4) with the translation in its last column, from rows or columns."""
    try:
        matrix = np.array(given, np.float64).reshape(4, 4)
    except (TypeError, ValueError):
        refuse(culprit, "a matrix of 4 x 4 numbers", f"{given!r:.40} came", _MEND)
    if not np.isfinite(matrix).all() or not abs(np.linalg.det(matrix[:3, :3])) > 1e-12:
        refuse(culprit, "a matrix that turns", "this one is flat or not finite", _MEND)
    return matrix.T if matrix[3, :3].any() and not matrix[:3, 3].any() else matrix


def _filled(rows: list[_Row]) -> list[Doubles]:
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
            came = f"{after.seconds:g} s comes after {before.seconds:g} s"
            refuse(f"{path}, line {after.line}", "times that go on", came, "Sort the lines")
