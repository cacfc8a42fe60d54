"""Landmarks as weighted means of mesh points."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse
from dermis.base.quantities import checked_integer
from dermis.base.reading import checked_path, read_text, refuse_parse_errors
from dermis.base.tables import Rows, parse_rows, read_rows
from dermis.human.landmarks.sets import LANDMARK_SETS
from dermis.human.regions.average import average_head, is_human
from dermis.mesh.head import Head
from dermis.mesh.strands import Roots, quad_corners, quad_weights, refine_roots

_MAX_LANDMARKS = 10_000
_EXPECTED_TABLE_FORMAT = "landmarks in CSV: rows of name,vertex"


@dataclass(frozen=True, eq=False)
class LandmarkPoints:
    """Landmarks of a mesh, which move with expressions and poses as weighted means of four mesh points.

    names : names of the n landmarks in the order of the set
    point, weight : (n, 4) indices of the mesh points, and their weights
    material : (n,) index of the material that must be seen at a landmark for it to count as visible; -1 if
        any material will do
    """

    names: tuple[str, ...]
    point: NDArray[np.int32]
    weight: NDArray[np.float32]
    material: NDArray[np.int32]


def landmark_points(head: Head, set_or_table: str) -> LandmarkPoints:
    """Return the landmarks of a head, from a published set or from a table of vertices.

    set_or_table : one of `LANDMARK_SETS`, or a CSV file with the columns name and vertex; a vertex is an
        index into `Head.positions_mm`

    Raises DermisError for a published set if the head is not a parametric human, and for tables that cannot
    be read.
    """
    if set_or_table not in LANDMARK_SETS:
        return _table_landmarks(head, set_or_table)
    if not is_human(head):
        actual = f"{head.name!r} has a topology of its own"
        advice = "Write a CSV table of name,vertex for its mesh, and pass the name of that file"
        refuse(f"landmarks {set_or_table}", "a head of the parametric human", actual, advice)
    return _human_landmarks(head, _landmark_rows(set_or_table))


def check_landmarks(set_or_table: object) -> str:
    """Return the name of a landmark set, or the path of a landmark table, after validation.

    Raises DermisError for anything except published sets and .csv files.
    """
    text = str(checked_path(set_or_table, "a set of landmarks or its table"))
    if text not in LANDMARK_SETS and not text.endswith(".csv"):
        expected = f"{', '.join(LANDMARK_SETS)} or a CSV table"
        refuse("landmarks", expected, f"got {format_value(text)}", "Correct the name")
    return text


def read_landmark_table(table_path: str) -> list[tuple[str, int]]:
    """Return (name, vertex index) pairs from a CSV file of landmarks.

    Raises DermisError for tables that cannot be read.
    """
    text = read_text(check_landmarks(table_path), _EXPECTED_TABLE_FORMAT)
    with refuse_parse_errors(table_path, _EXPECTED_TABLE_FORMAT, KeyError, TypeError, csv.Error):
        found = [(str(row["name"]), int(row["vertex"])) for row in parse_rows(text)]
    if not 0 < len(found) <= _MAX_LANDMARKS:
        refuse(table_path, f"1 to {_MAX_LANDMARKS} landmarks", f"got {len(found)}", "Correct the table")
    return found


@cache
def _landmark_rows(set_name: str) -> Rows:
    return read_rows(__package__, set_name)


def _human_landmarks(head: Head, landmark_rows: Rows) -> LandmarkPoints:
    quad = np.array([int(row["quad"]) for row in landmark_rows], np.int32)
    position = np.array([[float(row["along"]), float(row["across"])] for row in landmark_rows], np.float32)
    refined = refine_roots(average_head().mesh, Roots(quad, position), head.levels)
    point, weight = quad_corners(head.mesh, refined.quad), quad_weights(refined.position).astype(np.float32)
    material = np.full(len(landmark_rows), -1, np.int32)
    for k in np.flatnonzero([float(row["sunk"]) > 0 for row in landmark_rows]):
        assert head.eyes is not None
        eye_material = head.mesh.material[head.mesh.quads[refined.quad[k], 0]]
        back = head.eyes.back[head.eyes.material == eye_material][0]
        sunk, apex = float(landmark_rows[k]["sunk"]), point[k, weight[k].argmax()]
        point[k], weight[k], material[k] = (apex, back, back, back), (1 - sunk, sunk, 0, 0), eye_material
    return LandmarkPoints(tuple(row["landmark"] for row in landmark_rows), point, weight, material)


def _table_landmarks(head: Head, table_path: str) -> LandmarkPoints:
    found, count = read_landmark_table(table_path), len(head.positions_mm)
    for landmark, vertex in found:
        checked_integer(f"{Path(table_path).name}: vertex of {landmark}", vertex, 0, count - 1)
    point = np.repeat(np.array([[vertex] for _, vertex in found], np.int32), 4, axis=1)
    weight = np.tile(np.array([1, 0, 0, 0], np.float32), (len(found), 1))
    names = tuple(landmark for landmark, _ in found)
    return LandmarkPoints(names, point, weight, np.full(len(found), -1, np.int32))
