"""Landmarks in a photograph, read from a file."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.reading import parse_json, read_text, understood
from dermis.base.tables import parse_rows
from dermis.human.landmarks.sets import SETS

Floats = NDArray[np.float64]
_EXPECTED = "landmarks: CSV rows of name,x,y in pixels, or JSON by MediaPipe or dermis render"
_BY_COUNT = {68: "ibug-68", 70: "face-synthetics-70", 468: "mediapipe", 478: "mediapipe"}
_MEDIAPIPE = "face_landmarks", "faceLandmarks", "multi_face_landmarks", "landmarks", "landmark"
_LEAST = 6


def read_landmarks(path: str | Path, size: tuple[int, int]) -> tuple[str, dict[str, Floats]]:
    """The name of their set, and where each is: (2,) x to the right, y down, the first pixel's middle at 0.

    size : width and height of the photograph, to which MediaPipe's shares refer [pixel]

    Raises DermisError for files that hold none, and for sets that nobody knows.
    """
    text = read_text(path, _EXPECTED)
    if Path(path).suffix.lower() == ".json":
        name, found = _of_json(path, parse_json(text, path, _EXPECTED), size)
    else:
        with understood(path, _EXPECTED, KeyError, TypeError, csv.Error):
            rows = [(row["name"], float(row["x"]), float(row["y"])) for row in parse_rows(text)]
        found = {str(one): np.array([x, y]) for one, x, y in rows}
        name = _BY_COUNT.get(len(found), "")
    if len(found) < _LEAST or not all(np.isfinite(one).all() for one in found.values()):
        refuse(path, f"{_LEAST} landmarks at least", f"{len(found)} came", "Correct the file")
    if name not in SETS:
        expected = f"as many landmarks as {', '.join(map(str, _BY_COUNT))}, or JSON that names their set"
        refuse(path, expected, f"{len(found)} came", "Give all of a set")
    return name, found


def _of_json(path: str | Path, told: Any, size: tuple[int, int]) -> tuple[str, dict[str, Floats]]:
    """Those of `dermis render --landmarks`, or of MediaPipe: its points' shares of width and height."""
    with understood(path, _EXPECTED, KeyError, TypeError, IndexError):
        if isinstance(told, Mapping) and isinstance(told.get("landmarks"), Mapping):
            name, rows = next(iter(told["landmarks"].items()))
            return name, {str(row["name"]): np.asarray(row["pixel"], np.float64) for row in rows}
        while not _is_points(told):  # of the first face
            told = (
                next(told[key] for key in _MEDIAPIPE if key in told) if isinstance(told, Mapping) else told[0]
            )
        points = np.array([[one["x"], one["y"]] for one in told], np.float64)
    return _BY_COUNT.get(len(points), ""), dict(
        zip(map(str, range(len(points))), points * size - 0.5, strict=True)
    )


def _is_points(told: Any) -> bool:
    return isinstance(told, list) and bool(told) and isinstance(told[0], Mapping) and "x" in told[0]
