"""The region of the face of each texel of a head's atlas, by a warp of landmarks onto the average human."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.base.errors import refuse
from dermis.base.quantities import checked_array
from dermis.base.reading import parsing, read_text
from dermis.base.tables import parse_rows
from dermis.formats.maps import load_labels
from dermis.human.regions.average import (
    average_head,
    average_positions,
    average_skin,
    classify_surface,
    control_quads,
    human_landmarks,
    is_human,
)
from dermis.human.regions.region_table import REGIONS, Doubles, RegionTable
from dermis.mesh.head import Head

Point = tuple[float, float, float]
Landmarks = Mapping[str, Point]

_MIN_LANDMARKS = 10
_MIN_DEPTH_MM = 2.0  # root mean square distance from a plane: the warp needs three dimensions
_MAX_SKIN_DISTANCE_MM = 15.0  # centres of eyes lie this deep; what is farther belongs to another head
_MAX_COORDINATE_MM = 1e6
_SMOOTHING = 1.0  # for places picked by eye; 0 would carry each landmark exactly onto its twin


def load_landmarks(path: Path) -> Landmarks:
    """Places [mm from the head's centre] by name, from a CSV with landmark,x,y,z and comments after #."""
    return _parse_landmarks(read_text(path, "landmarks in CSV"), str(path))


def known_landmarks(head: Head) -> Landmarks | None:
    """Landmarks that the package has for a head, if any: the human's, or by its name [mm from its centre]."""
    if is_human(head):
        return _to_tuples(human_landmarks(head), head.centre_mm)
    file = resources.files(__package__) / "landmarks" / f"{Path(head.name).stem}.csv"
    return _parse_landmarks(file.read_text("utf-8"), file.name) if file.is_file() else None


@cache
def average_landmarks() -> Landmarks:
    """All landmarks that can be given, where they are on the average human [mm]."""
    return _to_tuples(human_landmarks(average_head()))


def _to_tuples(places: Mapping[str, Doubles], origin: Point = (0.0, 0.0, 0.0)) -> Landmarks:
    apart = {name: place - np.array(origin) for name, place in places.items()}
    return {name: (float(x), float(y), float(z)) for name, (x, y, z) in apart.items()}


def warp_to_average(head: Head, places: Landmarks, points: Doubles) -> Doubles:
    """Where points (n, 3) on a head [mm] lie on or near the average human (n, 3) [mm].

    places : the head's landmarks, some of `average_landmarks` [mm from its centre]

    An affine map and a smooth bending, linear in the distance to each landmark.
    """
    from scipy.interpolate import RBFInterpolator

    average = average_landmarks()
    _check_landmarks(head, places, average)
    ours, theirs = np.array(list(places.values())), np.array([average[name] for name in places])
    warp = RBFInterpolator(ours, theirs, kernel="linear", degree=1, smoothing=_SMOOTHING)
    return np.asarray(warp(points - np.array(head.centre_mm)))


def _parse_landmarks(text: str, name: str) -> Landmarks:
    expected = "rows of landmark,x,y,z"
    with parsing(name, expected, KeyError, TypeError, csv.Error):
        found = {row["landmark"]: tuple(float(row[axis]) for axis in "xyz") for row in parse_rows(text)}
    if not found:
        refuse(name, expected, "there are none", "Add them")
    for landmark, place in found.items():
        checked_array(f"{name}: {landmark}", place, (3,), -_MAX_COORDINATE_MM, _MAX_COORDINATE_MM, "mm")
    return {landmark: (x, y, z) for landmark, (x, y, z) in found.items()}


def _check_landmarks(head: Head, places: Landmarks, average: Landmarks) -> None:
    culprit = f"landmarks of {head.name}"
    for name in places.keys() - average.keys():
        refuse(culprit, f"only {', '.join(average)}", f"got {name!r}", "Correct its name")
    if len(places) < _MIN_LANDMARKS:
        refuse(culprit, f"at least {_MIN_LANDMARKS}", f"got {len(places)}", "Add some all around the head")
    skin = head.mesh.positions - np.array(head.centre_mm)
    for name, place in places.items():
        off = float(np.linalg.norm(skin - place, axis=1).min())
        if not off < _MAX_SKIN_DISTANCE_MM:
            actual = f"{name!r} is {off:.0f} mm off the nearest corner of the mesh"
            refuse(culprit, "places on the skin, in mm from the head's centre", actual, "Correct the place")
    points_mm = np.array(list(places.values()))
    off_plane = np.linalg.svd(points_mm - points_mm.mean(axis=0), compute_uv=False)[-1] / np.sqrt(
        len(points_mm)
    )
    if off_plane < _MIN_DEPTH_MM:
        refuse(culprit, "places all around the head", "they lie in one plane", "Add some beside it")


def label_texels(head: Head, atlas: Atlas, table: RegionTable) -> NDArray[np.uint8]:
    """Index into `REGIONS` (n,) of each texel that the atlas covers, in the order of its rows.

    The table's picture of labels or its landmarks, else the head's own labels, else what the package knows of
    the head: the points of the human, or landmarks. Raises DermisError for a head with none of these.
    """
    if table.labels is not None:
        return _labels_from_map(load_labels(table.labels), atlas, str(table.labels))
    if table.landmarks is not None:
        return _labels_from_landmarks(head, atlas, load_landmarks(table.landmarks))
    if head.maps.region is not None:
        return _labels_from_map(head.maps.region, atlas, head.name)
    if is_human(head):
        return _labels_of_human(head, atlas)
    places = known_landmarks(head)
    if places is None:
        advice = "Name a file of its landmarks, or a picture of its labels, in the table"
        refuse(head.name, "a head whose regions are known", "it has no labels", advice)
    return _labels_from_landmarks(head, atlas, places)


def _labels_from_map(labels: NDArray[np.uint8], atlas: Atlas, name: str) -> NDArray[np.uint8]:
    y, x = np.nonzero(atlas.coverage)
    height, width = labels.shape
    chosen = labels[y * height // atlas.size, x * width // atlas.size]
    if chosen.size and chosen.max() >= len(REGIONS):
        expected = f"labels from 0 to {len(REGIONS) - 1} on the skin"
        refuse(name, expected, f"got {chosen.max()}", "Correct the picture")
    return np.asarray(chosen)


def _labels_from_landmarks(head: Head, atlas: Atlas, places: Landmarks) -> NDArray[np.uint8]:
    corners = warp_to_average(head, places, head.mesh.positions.astype(np.float64))
    points = atlas.interpolate(head.mesh, corners)[atlas.coverage]
    return classify_surface(points, average_skin().nearest_quads(points))


def _labels_of_human(head: Head, atlas: Atlas) -> NDArray[np.uint8]:
    """Of a head of the parametric human, which all have the same quads."""
    points = atlas.interpolate(head.mesh, average_positions(head))[atlas.coverage]
    return classify_surface(points, control_quads(head, atlas.triangle[atlas.coverage]))
