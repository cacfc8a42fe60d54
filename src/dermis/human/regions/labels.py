"""Which region of the face each texel of a head's atlas belongs to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.errors import refuse
from dermis.human.bust.regions import REGIONS, region_of
from dermis.human.regions.landmarks import AVERAGE, Places, known_landmarks, load_landmarks, to_average
from dermis.human.regions.table import RegionTable
from dermis.mesh.head import Head
from dermis.mesh.maps import load_labels


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
