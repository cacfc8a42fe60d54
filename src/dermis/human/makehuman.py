"""Access to MakeHuman's data of the parametric human: points, morph targets, uv layouts and bones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import format_value, refuse

Points = NDArray[np.float64]

YOUNG_AGE, OLD_AGE = 25.0, 90.0
"""Ages of the published young and old people [years]."""

DELTA_UNIT_MM = 0.01
"""Unit of the displacements in the published files [mm]."""

EXPRESSION_PREFIX = "faceunits/"
"""Prefix of the names of the ARKit blend shapes."""


class TargetDeltas(NamedTuple):
    """Displacements of all t morph targets of MakeHuman, concatenated.

    names : names of the targets, with their folders
    first : (t + 1,) index of the first displacement of each target; the last element is m
    point, delta_mm : (m,) indices of the displaced points, and (m, 3) displacements at a weight of 1 [mm]
    """

    names: tuple[str, ...]
    first: NDArray[np.int64]
    point: NDArray[np.int64]
    delta_mm: NDArray[np.float32]


def morphed_points_mm(target_weights: Mapping[str, float]) -> Points:
    """Return the points (n, 3) of a person's mesh, followed by the joints of the skeleton [mm].

    The origin is the midpoint between the eyes.

    target_weights : mapping from names of MakeHuman's morph targets to weights

    Raises DermisError for names that are not morph targets of MakeHuman.
    """
    arrays, targets = makehuman_arrays(), target_deltas()
    points = [np.arange(len(arrays["positions_mm"]))]
    deltas: list[NDArray[np.floating]] = [arrays["positions_mm"].astype(np.float64)]
    check_targets(target_weights)
    known = _target_indices()
    for name, weight in target_weights.items():
        part = slice(*targets.first[known[name] : known[name] + 2])
        points.append(targets.point[part])
        deltas.append(weight * targets.delta_mm[part])
    point, delta = np.concatenate(points), np.concatenate(deltas)
    positions_mm = np.stack([np.bincount(point, column) for column in delta.T], axis=1)
    eyes = [list(map(str, arrays["joint_names"])).index(name) for name in ("l-eye", "r-eye")]
    return np.asarray(positions_mm - positions_mm[mesh_point_count() :][eyes].mean(axis=0))


@cache
def _target_indices() -> Mapping[str, int]:
    """Return a dictionary from the name of each of MakeHuman's morph targets to its index."""
    return {name: index for index, name in enumerate(target_deltas().names)}


def check_targets(names: Iterable[str]) -> None:
    """Raise DermisError for names that are not morph targets of MakeHuman; suggest similar names."""
    for name in names:
        if name not in _target_indices():
            known = target_deltas().names
            close = [one for one in known if name.split("/")[-1] in one][:3]
            hint = f"Did you mean {' or '.join(close)}?" if close else "List: dermis head --list-targets"
            actual = "this name is unknown"
            refuse(f"target {format_value(name)}", "a published target", actual, hint)


@cache
def human_targets() -> tuple[str, ...]:
    """Return the names of the morph targets that change the shape of a person.

    Returns
    -------
    tuple of str
        Names for `Human(targets=...)`.

    Examples
    --------
    >>> import dermis
    >>> "nose/nose-hump-incr" in dermis.human_targets()
    True
    """
    excluded = EXPRESSION_PREFIX, "expression/"
    return tuple(name for name in target_deltas().names if not name.startswith(excluded))


@cache
def makehuman_arrays() -> Mapping[str, NDArray[Any]]:
    """Return the arrays of data/human.npz by name: MakeHuman's mesh, morph targets and bones."""
    file = resources.files(__package__).joinpath("data", "human.npz")
    with resources.as_file(file) as path, np.load(path) as stored:
        return {name: stored[name] for name in stored}


@cache
def group_points(group_name: str) -> NDArray[np.int64]:
    """Return the sorted point indices of a mesh group, such as "helper-l-eye" for the left eyeball."""
    arrays = makehuman_arrays()
    group = list(map(str, arrays["group_names"])).index(group_name)
    return np.unique(arrays["quads"][arrays["group"] == group]).astype(np.int64)


def mesh_point_count() -> int:
    """Return the number of mesh points, which precede the joints in the array of points."""
    arrays = makehuman_arrays()
    return len(arrays["positions_mm"]) - len(arrays["joint_names"])


@cache
def target_deltas() -> TargetDeltas:
    """Return the displacements of all morph targets of MakeHuman."""
    arrays = makehuman_arrays()
    delta = DELTA_UNIT_MM * arrays["target_delta"].astype(np.float32)
    first, point = (arrays[name].astype(np.int64) for name in ("target_first", "target_point"))
    return TargetDeltas(tuple(map(str, arrays["target_names"])), first, point, delta)
