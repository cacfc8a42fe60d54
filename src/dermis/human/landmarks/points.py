"""Landmarks as means of points of a head's mesh."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse
from dermis.base.quantities import checked_integer
from dermis.base.reading import checked_path, parsing, read_text
from dermis.base.tables import Rows, parse_rows, read_rows
from dermis.human.landmarks.sets import SETS
from dermis.human.regions.average import average_head, is_human
from dermis.mesh.head import Head
from dermis.mesh.strands import Roots, corners, finer_roots, weights

_MAX_LANDMARKS = 10_000
_EXPECTED = "landmarks in CSV: rows of name,vertex"


@dataclass(frozen=True, eq=False)
class LandmarkPoints:
    """Landmarks by the points of a head's mesh.

    names : in order
    corner, share : (n, 4) points whose mean each is, and their shares
    material : (n,) index of what has to be seen there for it to count as seen; -1 for any surface near it
    """

    names: tuple[str, ...]
    corner: NDArray[np.int32]
    share: NDArray[np.float32]
    material: NDArray[np.int32]


def landmark_points(head: Head, name: str) -> LandmarkPoints:
    """Those of a set, or of a table by vertex.

    name : one of `SETS`, or a file of rows name,vertex; vertices are counted from 0 as
        `Head.positions_mm` lists them

    Raises DermisError for a set on a head of another topology, and for tables that cannot be read.
    """
    if name not in SETS:
        return _table_landmarks(head, name)
    if not is_human(head):
        actual = f"{head.name!r} has a topology of its own"
        advice = "Write a table of name,vertex for its mesh, and give the name of that file"
        refuse(f"landmarks {name}", "a head of the parametric human", actual, advice)
    return _human_landmarks(head, _rows(name))


def check_landmarks(name: object) -> str:
    """The name of a set or of a table's file.

    Raises DermisError for what is neither.
    """
    text = str(checked_path(name, "a set of landmarks or its table"))
    if text not in SETS and not text.endswith(".csv"):
        expected = f"{', '.join(SETS)} or a CSV table"
        refuse("landmarks", expected, f"got {format_value(text)}", "Correct the name")
    return text


def read_landmark_table(name: str) -> list[tuple[str, int]]:
    """Name and vertex of each landmark in a table's file.

    Raises DermisError for tables that cannot be read.
    """
    text = read_text(check_landmarks(name), _EXPECTED)
    with parsing(name, _EXPECTED, KeyError, TypeError, csv.Error):
        found = [(str(row["name"]), int(row["vertex"])) for row in parse_rows(text)]
    if not 0 < len(found) <= _MAX_LANDMARKS:
        refuse(name, f"1 to {_MAX_LANDMARKS} landmarks", f"got {len(found)}", "Correct the table")
    return found


@cache
def _rows(name: str) -> Rows:
    return read_rows(__package__, name)


def _human_landmarks(head: Head, rows: Rows) -> LandmarkPoints:
    quad = np.array([int(row["quad"]) for row in rows], np.int32)
    place = np.array([[float(row["along"]), float(row["across"])] for row in rows], np.float32)
    fine = finer_roots(average_head().mesh, Roots(quad, place), head.levels)
    corner, share = corners(head.mesh, fine.quad), weights(fine.place).astype(np.float32)
    material = np.full(len(rows), -1, np.int32)
    for k in np.flatnonzero([float(row["sunk"]) > 0 for row in rows]):
        assert head.eyes is not None
        eye_material = head.mesh.material[head.mesh.quads[fine.quad[k], 0]]
        back = head.eyes.back[head.eyes.material == eye_material][0]
        sunk, apex = float(rows[k]["sunk"]), corner[k, share[k].argmax()]
        corner[k], share[k], material[k] = (apex, back, back, back), (1 - sunk, sunk, 0, 0), eye_material
    return LandmarkPoints(tuple(row["landmark"] for row in rows), corner, share, material)


def _table_landmarks(head: Head, name: str) -> LandmarkPoints:
    found, count = read_landmark_table(name), len(head.positions_mm)
    for landmark, vertex in found:
        checked_integer(f"{Path(name).name}: vertex of {landmark}", vertex, 0, count - 1)
    corner = np.repeat(np.array([[vertex] for _, vertex in found], np.int32), 4, axis=1)
    share = np.tile(np.array([1, 0, 0, 0], np.float32), (len(found), 1))
    return LandmarkPoints(tuple(one for one, _ in found), corner, share, np.full(len(found), -1, np.int32))
