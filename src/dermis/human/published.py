"""The published data of the parametric human: points, targets, layouts, bones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse, shown_value

Points = NDArray[np.float64]

YOUNG, OLD = 25.0, 90.0
"""Ages of the published people [years]."""

DELTA_MM = 0.01
"""Of a unit of displacements, here as in the published files."""

FACE_UNITS = "faceunits/"
"""How the names of the ARKit blend shapes begin."""


class Moves(NamedTuple):
    """What published targets move, one after the other: points, displacements [mm], and where each begins."""

    names: tuple[str, ...]
    first: NDArray[np.int64]
    point: NDArray[np.int64]
    delta_mm: NDArray[np.float32]


def places_mm(weights: Mapping[str, float]) -> Points:
    """(n, 3) the points of a person, then the joints, from the middle between the eyes [mm].

    weights : of published targets

    Raises DermisError for targets that nobody knows.
    """
    found, moved = data(), moves()
    points = [np.arange(len(found["positions_mm"]))]
    deltas: list[NDArray[np.floating]] = [found["positions_mm"].astype(np.float64)]
    check_targets(weights)
    known = _numbers()
    for name, weight in weights.items():
        part = slice(*moved.first[known[name] : known[name] + 2])
        points.append(moved.point[part])
        deltas.append(weight * moved.delta_mm[part])
    point, delta = np.concatenate(points), np.concatenate(deltas)
    places = np.stack([np.bincount(point, column) for column in delta.T], axis=1)
    eyes = [list(map(str, found["joint_names"])).index(name) for name in ("l-eye", "r-eye")]
    return np.asarray(places - places[count() :][eyes].mean(axis=0))


@cache
def _numbers() -> Mapping[str, int]:
    """By names of targets which they are."""
    return {name: number for number, name in enumerate(moves().names)}


def check_targets(names: Iterable[str]) -> None:
    """Raises DermisError for a target that is not published."""
    for name in names:
        if name not in _numbers():
            known = moves().names
            close = [one for one in known if name.split("/")[-1] in one][:3]
            hint = f"Did you mean {' or '.join(close)}?" if close else "List: dermis head --list-targets"
            came = "there is none of this name"
            refuse(f"target {shown_value(name)}", "a published target", came, hint)


@cache
def human_targets() -> tuple[str, ...]:
    """Names of the published targets by which people differ, for `Human(targets=...)`."""
    return tuple(name for name in moves().names if not name.startswith((FACE_UNITS, "expression/")))


@cache
def data() -> Mapping[str, NDArray[Any]]:
    """The package's file."""
    file = resources.files(__package__).joinpath("data", "human.npz")
    with resources.as_file(file) as path, np.load(path) as stored:
        return {name: stored[name] for name in stored}


def count() -> int:
    """Of the points of the mesh, which joints come after."""
    found = data()
    return len(found["positions_mm"]) - len(found["joint_names"])


@cache
def moves() -> Moves:
    """What all targets move."""
    found = data()
    delta = DELTA_MM * found["target_delta"].astype(np.float32)
    first, point = (found[name].astype(np.int64) for name in ("target_first", "target_point"))
    return Moves(tuple(map(str, found["target_names"])), first, point, delta)
