"""Average human: its head and outer skin, and the face regions and landmarks that are defined on them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.tables import read_rows
from dermis.human.model import MATERIAL_OF_GROUP, build_head, head_template
from dermis.human.person import Human
from dermis.human.regions.region_table import Doubles, classify_regions
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps

AVERAGE_HUMAN = Human(sex=0.5, age=35.0)
_DENSE_SUBDIVISION_LEVELS = 2  # levels of subdivision, for triangles of about 1 mm
_EYE_LANDMARKS = ("left eye", "right eye")  # names of landmarks and of the materials whose centres they are
_MOUTH_MATERIALS = ("upper teeth", "lower teeth", "tongue")


class DenseSkin(NamedTuple):
    """Dense samples of the average human's outer skin, for nearest-neighbour queries.

    quad_index : (n,) index of the control quad that contains each sample
    tree : k-d tree of the sample positions [mm]
    """

    quad_index: NDArray[np.int64]
    tree: Any

    def nearest_quads(self, points: Doubles) -> NDArray[np.int64]:
        """Return the index (m,) of the control quad nearest to each point (m, 3) [mm]."""
        return np.asarray(self.quad_index[self.tree.query(points, workers=-1)[1]])


@cache
def average_head() -> Head:
    """Return the bare head of the average human without subdivision."""
    return _bare_head(0)


@cache
def average_skin() -> DenseSkin:
    """Return dense samples of the average human's outer skin, without the inside of the mouth."""
    from scipy.spatial import cKDTree

    head = _bare_head(_DENSE_SUBDIVISION_LEVELS)
    mesh = head.mesh
    quad_index = control_quads(head, np.arange(len(mesh.triangles)))
    is_outer = (mesh.material == 0) & ~np.isin(quad_index, quads_of_parts()["mouth"])
    centroids = mesh.positions[mesh.triangles[is_outer]].astype(np.float64).mean(axis=1)
    return DenseSkin(quad_index[is_outer], cKDTree(centroids))


def _bare_head(levels: int) -> Head:
    """Return the head of the average human, subdivided `levels` times and without its hair."""
    return head_template("own", levels).refine_head(
        build_head(AVERAGE_HUMAN.target_weights(), Maps(), "own", EyeLook())
    )


def landmark_indices() -> dict[str, int]:
    """Return a dictionary from the name of each skin landmark to the index of its control point."""
    return {row["landmark"]: int(row["point"]) for row in read_rows(__package__, "points")}


def human_landmarks(head: Head) -> dict[str, Doubles]:
    """Return a dictionary from name to position (3,) of the skin landmarks and eye centres of a human [mm].

    head : head of the parametric human
    """
    positions_mm = head.positions_mm.astype(np.float64)
    landmarks = {name: positions_mm[point] for name, point in landmark_indices().items()}
    mesh = head.mesh
    for name in _EYE_LANDMARKS:
        material = [one.name for one in mesh.materials].index(name)
        corners = np.unique(mesh.triangles[mesh.material == material])
        landmarks[name] = mesh.positions[corners].astype(np.float64).mean(axis=0)
    return landmarks


def is_human(head: Head) -> bool:
    """Return whether a head is a parametric human, judged by its control points, targets and materials."""
    head = head.body
    rig = head.rig
    if rig is None or head.mesh.materials != tuple(MATERIAL_OF_GROUP.values()):
        return False  # without building the average head
    average = average_head().control_rig
    return rig.positions_mm.shape == average.positions_mm.shape and rig.targets.names == average.targets.names


def control_quads(head: Head, triangle_index: NDArray[Any]) -> NDArray[np.int64]:
    """Return the index (n,) of the control quad from which each triangle was subdivided.

    head : parametric human in either uv layout, at any level of subdivision
    triangle_index : (n,) triangle indices
    """
    control_triangles = len(average_head().mesh.triangles)
    levels = 0
    while len(head.body.mesh.triangles) > control_triangles * 4**levels:
        levels += 1
    return np.asarray(triangle_index // (2 * 4**levels), np.int64)


def average_positions(head: Head) -> Doubles:
    """Return for each vertex of a parametric human the corresponding point (v, 3) of the average human [mm].

    Regions defined on the average human are looked up at these points.
    """
    points_mm = average_head().positions_mm.astype(np.float64)
    head = head.body
    stencils = head.control_rig.stencils
    return np.asarray((points_mm if stencils is None else stencils.points(points_mm))[head.mesh.point])


def classify_surface(points: Doubles, quad_index: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the face region (n,) of points on or near the average human, as indices into `REGIONS`.

    points : (n, 3) positions [mm]
    quad_index : (n,) for each point, the index of the nearest quad of the average head before subdivision
    """
    parts, mesh = quads_of_parts(), average_head().mesh
    mouth_materials = [k for k, one in enumerate(mesh.materials) if one.name in _MOUTH_MATERIALS]
    mouth = np.isin(mesh.material[2 * quad_index], mouth_materials)
    lips = np.isin(quad_index, np.concatenate([parts["lips"], parts["mouth"]])) | mouth
    return classify_regions(points, lips, np.isin(quad_index, parts["ears"])).astype(np.uint8)


@cache
def quads_of_parts() -> Mapping[str, NDArray[np.int64]]:
    """Return a dictionary from part (lips, ears, inside of the mouth) to the indices of its control quads."""
    runs_by_part: dict[str, list[NDArray[np.int64]]] = {}
    for row in read_rows(__package__, "parts"):
        runs_by_part.setdefault(row["part"], []).append(np.arange(int(row["first"]), int(row["last"]) + 1))
    return {part: np.concatenate(runs) for part, runs in runs_by_part.items()}
