"""The average human, on which the regions of the face are told apart: landmarks, skin and regions of it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.tables import read_rows
from dermis.human.model import MATERIALS
from dermis.human.person import Human
from dermis.human.regions.region_table import Doubles, classify_regions
from dermis.mesh.head import Head

AVERAGE_HUMAN = Human(sex=0.5, age=35.0)
_LEVELS = 2  # of subdivision: triangles of about a millimetre
_EYE_LANDMARKS = ("left eye", "right eye")  # landmarks, and materials whose middles these are
_MOUTH_MATERIALS = ("upper teeth", "lower teeth", "tongue")


class DenseSkin(NamedTuple):
    """The outer skin of the average human, densely.

    quad : (n,) number of the human's quad at each place
    tree : of the places, to find the nearest
    """

    quad_index: NDArray[np.int64]
    tree: Any

    def nearest_quads(self, points: Doubles) -> NDArray[np.int64]:
        """Number (m,) of the human's quad that is nearest to each point (m, 3) [mm]."""
        return np.asarray(self.quad_index[self.tree.query(points)[1]])


@cache
def average_head() -> Head:
    """The average human without subdivision."""
    return AVERAGE_HUMAN.head(subdivide=0)


@cache
def average_skin() -> DenseSkin:
    """The skin that can be seen, not the inside of the mouth."""
    from scipy.spatial import cKDTree

    head = AVERAGE_HUMAN.head(subdivide=_LEVELS)
    mesh = head.mesh
    quad_index = control_quads(head, np.arange(len(mesh.triangles)))
    seen = (mesh.material == 0) & ~np.isin(quad_index, part_quads()["mouth"])
    places = mesh.positions[mesh.triangles[seen]].astype(np.float64).mean(axis=1)
    return DenseSkin(quad_index[seen], cKDTree(places))


def landmark_indices() -> dict[str, int]:
    """Control point of the human at each landmark that lies on skin."""
    return {row["landmark"]: int(row["point"]) for row in read_rows(__package__, "points")}


def human_landmarks(head: Head) -> dict[str, Doubles]:
    """Places (3,) of all landmarks on a head of the parametric human [mm]."""
    places = head.positions_mm.astype(np.float64)
    found = {name: places[point] for name, point in landmark_indices().items()}
    mesh = head.mesh
    for name in _EYE_LANDMARKS:
        material = [one.name for one in mesh.materials].index(name)
        corners = np.unique(mesh.triangles[mesh.material == material])
        found[name] = mesh.positions[corners].astype(np.float64).mean(axis=0)
    return found


def is_human(head: Head) -> bool:
    """Whether the head is one of the parametric human, by its points and what moves them."""
    expected, rig = average_head().control, head.rig
    return (
        rig is not None
        and rig.positions_mm.shape == expected.positions_mm.shape
        and rig.targets.names == expected.targets.names
        and head.mesh.materials == tuple(MATERIALS.values())
    )


def control_quads(head: Head, triangle: NDArray[Any]) -> NDArray[np.int64]:
    """Number (n,) of the human's own quad that triangles (n,) of a head, however fine, are of.

    head : of the parametric human, in either layout
    """
    own = len(average_head().mesh.triangles)
    levels = 0
    while len(head.mesh.triangles) > own * 4**levels:
        levels += 1
    return np.asarray(triangle // (2 * 4**levels), np.int64)


def average_positions(head: Head) -> Doubles:
    """Where the corner vertices (v, 3) of a head of the parametric human lie on the average one [mm]."""
    places = average_head().positions_mm.astype(np.float64)
    stencils = head.control.stencils
    return np.asarray((places if stencils is None else stencils.points(places))[head.mesh.point])


def classify_surface(places: Doubles, quad_index: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Index into `REGIONS` (n,) of places on or near the average human.

    places : (n, 3) [mm]
    quad : (n,) number of the human's quad at each
    """
    named, mesh = part_quads(), average_head().mesh
    mouth = [k for k, one in enumerate(mesh.materials) if one.name in _MOUTH_MATERIALS]
    within = np.isin(mesh.material[2 * quad_index], mouth)
    lips = np.isin(quad_index, np.concatenate([named["lips"], named["mouth"]])) | within
    label = classify_regions(places, lips, np.isin(quad_index, named["ears"]))
    return label.astype(np.uint8)


@cache
def part_quads() -> Mapping[str, NDArray[np.int64]]:
    """Numbers of the human's quads by what they are: lips, ears, the inside of the mouth."""
    found: dict[str, list[NDArray[np.int64]]] = {}
    for row in read_rows(__package__, "parts"):
        found.setdefault(row["part"], []).append(np.arange(int(row["first"]), int(row["last"]) + 1))
    return {part: np.concatenate(runs) for part, runs in found.items()}
