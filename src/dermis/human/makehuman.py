"""The published data of the parametric human: points, targets, layouts, bones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse

Points = NDArray[np.float64]

YOUNG, OLD = 25.0, 90.0
"""Ages of the published people [years]."""

DELTA_UNIT_MM = 0.01
"""Of a unit of displacements, here as in the published files."""

EXPRESSION_PREFIX = "faceunits/"
"""How the names of the ARKit blend shapes begin."""


class TargetDeltas(NamedTuple):
    """What published targets move, one after the other: points, displacements [mm], and where each begins."""

    names: tuple[str, ...]
    first: NDArray[np.int64]
    point: NDArray[np.int64]
    delta_mm: NDArray[np.float32]


def morphed_points_mm(weights: Mapping[str, float]) -> Points:
    """(n, 3) the points of a person, then the joints, from the middle between the eyes [mm].

    weights : of published targets

    Raises DermisError for targets that nobody knows.
    """
    found, moved = model_data(), target_deltas()
    points = [np.arange(len(found["positions_mm"]))]
    deltas: list[NDArray[np.floating]] = [found["positions_mm"].astype(np.float64)]
    check_targets(weights)
    known = _target_indices()
    for name, weight in weights.items():
        part = slice(*moved.first[known[name] : known[name] + 2])
        points.append(moved.point[part])
        deltas.append(weight * moved.delta_mm[part])
    point, delta = np.concatenate(points), np.concatenate(deltas)
    places = np.stack([np.bincount(point, column) for column in delta.T], axis=1)
    eyes = [list(map(str, found["joint_names"])).index(name) for name in ("l-eye", "r-eye")]
    return np.asarray(places - places[mesh_point_count() :][eyes].mean(axis=0))


@cache
def _target_indices() -> Mapping[str, int]:
    """By names of targets which they are."""
    return {name: number for number, name in enumerate(target_deltas().names)}


def check_targets(names: Iterable[str]) -> None:
    """Raises DermisError for a target that is not published."""
    for name in names:
        if name not in _target_indices():
            known = target_deltas().names
            close = [one for one in known if name.split("/")[-1] in one][:3]
            hint = f"Did you mean {' or '.join(close)}?" if close else "List: dermis head --list-targets"
            actual = "there is none of this name"
            refuse(f"target {format_value(name)}", "a published target", actual, hint)


@cache
def human_targets() -> tuple[str, ...]:
    """Names of the published targets by which people differ, for `Human(targets=...)`."""
    return tuple(
        name for name in target_deltas().names if not name.startswith((EXPRESSION_PREFIX, "expression/"))
    )


@cache
def model_data() -> Mapping[str, NDArray[Any]]:
    """The package's file."""
    file = resources.files(__package__).joinpath("data", "human.npz")
    with resources.as_file(file) as path, np.load(path) as stored:
        return {name: stored[name] for name in stored}


def mesh_point_count() -> int:
    """Of the points of the mesh, which joints come after."""
    found = model_data()
    return len(found["positions_mm"]) - len(found["joint_names"])


@cache
def target_deltas() -> TargetDeltas:
    """What all targets move."""
    found = model_data()
    delta = DELTA_UNIT_MM * found["target_delta"].astype(np.float32)
    first, point = (found[name].astype(np.int64) for name in ("target_first", "target_point"))
    return TargetDeltas(tuple(map(str, found["target_names"])), first, point, delta)
