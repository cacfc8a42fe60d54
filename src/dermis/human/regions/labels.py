"""The region of the face of each texel of a head's atlas, by a warp of landmarks onto the average bust."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.errors import refuse
from dermis.human.bust import ears
from dermis.human.bust.fields import Doubles, gradient
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.regions import REGIONS, region_of
from dermis.human.bust.shape import landmarks, symmetric
from dermis.human.regions.table import RegionTable
from dermis.mesh.head import Head
from dermis.mesh.maps import load_labels
from dermis.tables import parse_rows

Place = tuple[float, float, float]
Places = Mapping[str, Place]

AVERAGE = BustParameters(asymmetry=0.0)
"""The bust in whose space regions are told apart."""
# In the frame of the ear [mm].
_EAR = {
    "ear top": (17.5, 30, 3),
    "ear back": (31, 11, 2),
    "ear lobe": (8, -30, 0.5),
    "tragus": (-1.6, -5.5, 3.5),
}
_FEWEST = 10
_FLATTEST_MM = 2.0  # root mean square distance from a plane: the warp needs three dimensions
_FARTHEST_MM = 15.0  # centres of eyes lie this deep; what is farther belongs to another head
_SLACK = 1.0  # for places picked by eye; 0 would carry each landmark exactly onto its twin
_STEPS, _LONGEST_MM = 4, 4.0


def load_landmarks(path: Path) -> Places:
    """Places [mm from the head's centre] by name, from a CSV with landmark,x,y,z and comments after #."""
    try:
        return _read(path.read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        refuse(path, "landmarks in CSV", f"it cannot be read ({error})", "Check the name")


def known_landmarks(head: Head) -> Places | None:
    """The landmarks that the package has for a head of this name, if any."""
    file = resources.files(__package__) / "landmarks" / f"{Path(head.name).stem}.csv"
    return _read(file.read_text("utf-8"), file.name) if file.is_file() else None


@lru_cache(maxsize=1)
def average_landmarks() -> Mapping[str, Place]:
    """All landmarks that can be given, where they are on the average bust [mm]."""
    places = {name: place for name, place in landmarks(AVERAGE).items() if "ear" not in name.split()}
    for name, local in _EAR.items():
        place = ears.CENTRE + np.array(local) @ ears.FRAME
        places |= {f"left {name}": place, f"right {name}": place * (-1, 1, 1)}
    return {name: (float(x), float(y), float(z)) for name, (x, y, z) in places.items()}


def to_average(head: Head, places: Places, points: Doubles) -> Doubles:
    """Where points (n, 3) on a head [mm] lie on the average bust (n, 3) [mm].

    places : the head's landmarks, some of `average_landmarks` [mm from its centre]

    An affine map and a smooth bending, linear in the distance to each landmark, then along the field of the
    bust onto its skin.
    """
    from scipy.interpolate import RBFInterpolator

    average = average_landmarks()
    _check(head, places, average)
    ours, theirs = np.array(list(places.values())), np.array([average[name] for name in places])
    warp = RBFInterpolator(ours, theirs, kernel="linear", degree=1, smoothing=_SLACK)
    return _on_skin(warp(points - np.array(head.centre_mm)))


def _on_skin(points: Doubles) -> Doubles:
    for _ in range(_STEPS):
        slope = gradient(lambda p: symmetric(p, AVERAGE), points)
        step = symmetric(points, AVERAGE) / np.maximum((slope**2).sum(axis=1), 0.05)
        away = slope * step[:, None]
        length = np.linalg.norm(away, axis=1, keepdims=True)
        points = points - away * np.minimum(1, _LONGEST_MM / np.maximum(length, _LONGEST_MM))
    return points


def _read(text: str, name: str) -> Places:
    try:
        return {
            row["landmark"]: (float(row["x"]), float(row["y"]), float(row["z"])) for row in parse_rows(text)
        }
    except (KeyError, TypeError, ValueError) as error:
        refuse(name, "rows of landmark,x,y,z", f"one cannot be read ({error})", "Correct it there")


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

    The table's picture of labels or its landmarks, else the head's own labels, else the landmarks that the
    package has for the head. Raises DermisError for a head with none of these.
    """
    if table.labels is not None:
        return _sampled(load_labels(table.labels), atlas, str(table.labels))
    if table.landmarks is not None:
        return _warped(head, atlas, load_landmarks(table.landmarks))
    if head.maps.region is not None:
        return _sampled(head.maps.region, atlas, head.name)
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
    return region_of(points, AVERAGE).astype(np.uint8)
