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
from dermis.base.quantities import numbers
from dermis.base.reading import read_text, understood
from dermis.base.tables import parse_rows
from dermis.formats.maps import load_labels
from dermis.human.regions.average import (
    average_head,
    average_skin,
    control_quads,
    human_landmarks,
    human_regions,
    is_human,
    on_average,
)
from dermis.human.regions.zones import REGIONS, Doubles, RegionTable
from dermis.mesh.head import Head

Place = tuple[float, float, float]
Places = Mapping[str, Place]

_FEWEST = 10
_FLATTEST_MM = 2.0  # root mean square distance from a plane: the warp needs three dimensions
_FARTHEST_MM = 15.0  # centres of eyes lie this deep; what is farther belongs to another head
_FARTHEST_AWAY_MM = 1e6
_SLACK = 1.0  # for places picked by eye; 0 would carry each landmark exactly onto its twin


def load_landmarks(path: Path) -> Places:
    """Places [mm from the head's centre] by name, from a CSV with landmark,x,y,z and comments after #."""
    return _read(read_text(path, "landmarks in CSV"), str(path))


def known_landmarks(head: Head) -> Places | None:
    """Landmarks that the package has for a head, if any: the human's, or by its name [mm from its centre]."""
    if is_human(head):
        return _plain(human_landmarks(head), head.centre_mm)
    file = resources.files(__package__) / "landmarks" / f"{Path(head.name).stem}.csv"
    return _read(file.read_text("utf-8"), file.name) if file.is_file() else None


@cache
def average_landmarks() -> Places:
    """All landmarks that can be given, where they are on the average human [mm]."""
    return _plain(human_landmarks(average_head()))


def _plain(places: Mapping[str, Doubles], origin: Place = (0.0, 0.0, 0.0)) -> Places:
    apart = {name: place - np.array(origin) for name, place in places.items()}
    return {name: (float(x), float(y), float(z)) for name, (x, y, z) in apart.items()}


def to_average(head: Head, places: Places, points: Doubles) -> Doubles:
    """Where points (n, 3) on a head [mm] lie on or near the average human (n, 3) [mm].

    places : the head's landmarks, some of `average_landmarks` [mm from its centre]

    An affine map and a smooth bending, linear in the distance to each landmark.
    """
    from scipy.interpolate import RBFInterpolator

    average = average_landmarks()
    _check(head, places, average)
    ours, theirs = np.array(list(places.values())), np.array([average[name] for name in places])
    warp = RBFInterpolator(ours, theirs, kernel="linear", degree=1, smoothing=_SLACK)
    return np.asarray(warp(points - np.array(head.centre_mm)))


def _read(text: str, name: str) -> Places:
    expected = "rows of landmark,x,y,z"
    with understood(name, expected, KeyError, TypeError, csv.Error):
        found = {row["landmark"]: tuple(float(row[axis]) for axis in "xyz") for row in parse_rows(text)}
    if not found:
        refuse(name, expected, "there are none", "Add them")
    for landmark, place in found.items():
        numbers(f"{name}: {landmark}", place, (3,), -_FARTHEST_AWAY_MM, _FARTHEST_AWAY_MM, "mm")
    return {landmark: (x, y, z) for landmark, (x, y, z) in found.items()}


def _check(head: Head, places: Places, average: Places) -> None:
    culprit = f"landmarks of {head.name}"
    for name in places.keys() - average.keys():
        refuse(culprit, f"only {', '.join(average)}", f"{name!r} came", "Correct its name")
    if len(places) < _FEWEST:
        refuse(culprit, f"at least {_FEWEST}", f"{len(places)} came", "Add some all around the head")
    skin = head.mesh.positions - np.array(head.centre_mm)
    for name, place in places.items():
        off = float(np.linalg.norm(skin - place, axis=1).min())
        if not off < _FARTHEST_MM:
            came = f"{name!r} is {off:.0f} mm off the nearest corner of the mesh"
            refuse(culprit, "places on the skin, in mm from the head's centre", came, "Correct the place")
    spots = np.array(list(places.values()))
    off_plane = np.linalg.svd(spots - spots.mean(axis=0), compute_uv=False)[-1] / np.sqrt(len(spots))
    if off_plane < _FLATTEST_MM:
        refuse(culprit, "places all around the head", "they lie in one plane", "Add some beside it")


def label_texels(head: Head, atlas: Atlas, table: RegionTable) -> NDArray[np.uint8]:
    """Index into `REGIONS` (n,) of each texel that the atlas covers, in the order of its rows.

    The table's picture of labels or its landmarks, else the head's own labels, else what the package knows of
    the head: the points of the human, or landmarks. Raises DermisError for a head with none of these.
    """
    if table.labels is not None:
        return _sampled(load_labels(table.labels), atlas, str(table.labels))
    if table.landmarks is not None:
        return _warped(head, atlas, load_landmarks(table.landmarks))
    if head.maps.region is not None:
        return _sampled(head.maps.region, atlas, head.name)
    if is_human(head):
        return _human(head, atlas)
    places = known_landmarks(head)
    if places is None:
        remedy = "Name a file of its landmarks, or a picture of its labels, in the table"
        refuse(head.name, "a head whose regions are known", "it has no labels", remedy)
    return _warped(head, atlas, places)


def _sampled(labels: NDArray[np.uint8], atlas: Atlas, name: str) -> NDArray[np.uint8]:
    y, x = np.nonzero(atlas.coverage)
    height, width = labels.shape
    chosen = labels[y * height // atlas.size, x * width // atlas.size]
    if chosen.size and chosen.max() >= len(REGIONS):
        expected = f"labels from 0 to {len(REGIONS) - 1} on the skin"
        refuse(name, expected, f"{chosen.max()} came", "Correct the picture")
    return np.asarray(chosen)


def _warped(head: Head, atlas: Atlas, places: Places) -> NDArray[np.uint8]:
    corners = to_average(head, places, head.mesh.positions.astype(np.float64))
    points = atlas.interpolate(head.mesh, corners)[atlas.coverage]
    return human_regions(points, average_skin().quads(points))


def _human(head: Head, atlas: Atlas) -> NDArray[np.uint8]:
    """Of a head of the parametric human, which all have the same quads."""
    points = atlas.interpolate(head.mesh, on_average(head))[atlas.coverage]
    return human_regions(points, control_quads(head, atlas.triangle[atlas.coverage]))
