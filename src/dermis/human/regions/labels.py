"""Region labels of atlas texels, from a label map or from landmarks that map a head to the average human."""

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
from dermis.base.reading import read_text, refuse_parse_errors
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
_MIN_LANDMARK_DEPTH_MM = 2.0  # RMS distance from the best plane; the warp needs landmarks in three dimensions
_MAX_SKIN_DISTANCE_MM = 15.0  # eye centres are this deep; farther landmarks belong to another head
_MAX_COORDINATE_MM = 1e6
_WARP_SMOOTHING = 1.0  # for landmarks picked by hand; 0 would interpolate them exactly


def load_landmarks(path: Path) -> Landmarks:
    """Load a dictionary from landmark name to position from a CSV file with columns landmark,x,y,z.

    Positions are relative to the centre of the head [mm].
    """
    return _parse_landmarks(read_text(path, "landmarks in CSV"), str(path))


def known_landmarks(head: Head) -> Landmarks | None:
    """Return the landmarks of a human or of a sample head of the package, None for other heads.

    Positions are relative to the centre of the head [mm].
    """
    if is_human(head):
        return _landmark_tuples(human_landmarks(head), head.centre_mm)
    file = resources.files(__package__) / "landmarks" / f"{Path(head.name).stem}.csv"
    return _parse_landmarks(file.read_text("utf-8"), file.name) if file.is_file() else None


@cache
def average_landmarks() -> Landmarks:
    """Return a dictionary from landmark name to position on the average human [mm]."""
    return _landmark_tuples(human_landmarks(average_head()))


def _landmark_tuples(landmark_positions: Mapping[str, Doubles], origin: Point = (0.0, 0.0, 0.0)) -> Landmarks:
    relative = {name: position - np.array(origin) for name, position in landmark_positions.items()}
    return {name: (float(x), float(y), float(z)) for name, (x, y, z) in relative.items()}


def warp_to_average(head: Head, landmarks: Landmarks, points: Doubles) -> Doubles:
    """Map points (n, 3) of any head to the corresponding points (n, 3) on or near the average human [mm].

    The warp is an affine map plus radial basis functions that are linear in the distance to each landmark.

    landmarks : landmarks of the head, a subset of `average_landmarks`, relative to its centre [mm]
    points : (n, 3) positions in the coordinates of the head [mm]
    """
    from scipy.interpolate import RBFInterpolator

    average = average_landmarks()
    _check_landmarks(head, landmarks, average)
    source, target = np.array(list(landmarks.values())), np.array([average[name] for name in landmarks])
    warp = RBFInterpolator(source, target, kernel="linear", degree=1, smoothing=_WARP_SMOOTHING)
    return np.asarray(warp(points - np.array(head.centre_mm)))


def _parse_landmarks(csv_text: str, file_name: str) -> Landmarks:
    expected = "rows of landmark,x,y,z"
    with refuse_parse_errors(file_name, expected, KeyError, TypeError, csv.Error):
        landmarks = {
            row["landmark"]: tuple(float(row[axis]) for axis in "xyz") for row in parse_rows(csv_text)
        }
    if not landmarks:
        refuse(file_name, expected, "there are none", "Add them")
    for landmark, position in landmarks.items():
        checked_array(
            f"{file_name}: {landmark}", position, (3,), -_MAX_COORDINATE_MM, _MAX_COORDINATE_MM, "mm"
        )
    return {landmark: (x, y, z) for landmark, (x, y, z) in landmarks.items()}


def _check_landmarks(head: Head, landmarks: Landmarks, reference_landmarks: Landmarks) -> None:
    error_subject = f"landmarks of {head.name}"
    for name in landmarks.keys() - reference_landmarks.keys():
        refuse(error_subject, f"only {', '.join(reference_landmarks)}", f"got {name!r}", "Correct its name")
    if len(landmarks) < _MIN_LANDMARKS:
        actual = f"got {len(landmarks)}"
        refuse(error_subject, f"at least {_MIN_LANDMARKS}", actual, "Add some all around the head")
    skin = head.mesh.positions - np.array(head.centre_mm)
    for name, position in landmarks.items():
        distance = float(np.linalg.norm(skin - position, axis=1).min())
        if not distance < _MAX_SKIN_DISTANCE_MM:
            actual = f"{name!r} is {distance:.0f} mm off the nearest corner of the mesh"
            expected = "points on the skin, in mm from the head's centre"
            refuse(error_subject, expected, actual, "Correct its position")
    points_mm = np.array(list(landmarks.values()))
    singular_values = np.linalg.svd(points_mm - points_mm.mean(axis=0), compute_uv=False)
    if singular_values[-1] / np.sqrt(len(points_mm)) < _MIN_LANDMARK_DEPTH_MM:
        refuse(error_subject, "points all around the head", "they lie in one plane", "Add some outside of it")


def label_texels(head: Head, atlas: Atlas, region_table: RegionTable) -> NDArray[np.uint8]:
    """Return the region (n,) of each covered atlas texel in row order, as an index into `REGIONS`.

    Labels come from the first of these that is available: the label map or the landmarks in the table, the
    label map of the head, the regions of the parametric human, landmarks known to the package.

    Raises DermisError if none of them is available.
    """
    if region_table.labels is not None:
        return _labels_from_map(load_labels(region_table.labels), atlas, str(region_table.labels))
    if region_table.landmarks is not None:
        return _labels_from_landmarks(head, atlas, load_landmarks(region_table.landmarks))
    if head.maps.region is not None:
        return _labels_from_map(head.maps.region, atlas, head.name)
    if is_human(head):
        return _labels_of_human(head, atlas)
    landmarks = known_landmarks(head)
    if landmarks is None:
        advice = "Name a file of its landmarks, or a label map, in the table"
        refuse(head.name, "a head whose regions are known", "it has no labels", advice)
    return _labels_from_landmarks(head, atlas, landmarks)


def _labels_from_map(label_map: NDArray[np.uint8], atlas: Atlas, head_name: str) -> NDArray[np.uint8]:
    y, x = np.nonzero(atlas.coverage)
    height, width = label_map.shape
    chosen = label_map[y * height // atlas.size, x * width // atlas.size]
    if chosen.size and chosen.max() >= len(REGIONS):
        expected = f"labels from 0 to {len(REGIONS) - 1} on the skin"
        refuse(head_name, expected, f"got {chosen.max()}", "Correct the label map")
    return np.asarray(chosen)


def _labels_from_landmarks(head: Head, atlas: Atlas, landmarks: Landmarks) -> NDArray[np.uint8]:
    corners = warp_to_average(head, landmarks, head.mesh.positions.astype(np.float64))
    points = atlas.interpolate(head.mesh, corners)[atlas.coverage]
    return classify_surface(points, average_skin().nearest_quads(points))


def _labels_of_human(head: Head, atlas: Atlas) -> NDArray[np.uint8]:
    """Return the region labels of a parametric human's texels, by the control quad below each texel."""
    points = atlas.interpolate(head.mesh, average_positions(head))[atlas.coverage]
    return classify_surface(points, control_quads(head, atlas.triangle[atlas.coverage]))
