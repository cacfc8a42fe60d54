"""Table of correspondences between the parametric human and other face models: landmarks and blend shapes."""

from __future__ import annotations

from typing import Any

import numpy as np

from dermis.base.arrays import Index
from dermis.base.errors import refuse
from dermis.formats.deformable_mesh import DeformableMesh
from dermis.formats.gltf.write import part_name
from dermis.human.landmarks.points import LandmarkPoints, landmark_points
from dermis.human.landmarks.sets import LANDMARK_SETS, SILHOUETTE_SUFFIX
from dermis.human.regions.average import is_human
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh

_SHAPES_WITHOUT_MEDIAPIPE = ("tongueOut",)
_AXES = "x to the person's left, y up, z forward; origin and pose of exported files, blend shapes at weight 0"
_INDICES = (
    "points: indices of points of the prim `mesh` of an export to usd with the same --subdivide; vertices: "
    "indices of vertices in the named mesh of an export to gltf; a landmark is the mean with these weights"
)


def correspondence_table(head: Head) -> dict[str, Any]:
    """Return landmarks and blend shapes of a head of the parametric human as a dictionary for JSON.

    Each landmark is a weighted mean of four points, given as points of USD exports and as vertices of glTF
    exports. Raises DermisError for other heads.
    """
    if not is_human(head):
        actual, advice = "its mesh is another one", "Name a person: human, human:7 or a person's .json file"
        refuse(head.name, "a head of the parametric human", actual, advice)
    sets = [name for name in LANDMARK_SETS if not name.endswith(SILHOUETTE_SUFFIX)]
    return {
        "head": head.name,
        "unit": "mm",
        "axes": _AXES,
        "indices": _INDICES,
        "points": len(np.unique(head.mesh.point)),
        "licence": head.attribution,
        "landmarks": {name: _landmark_rows(head, landmark_points(head, name)) for name in sets},
        "blend_shapes": blend_shape_rows(head.control_rig.targets.names),
    }


def _landmark_rows(head: Head, landmarks: LandmarkPoints) -> list[dict[str, Any]]:
    positions = DeformableMesh(head).positions_mm
    mesh, rows = head.mesh, []
    stage_points, first = np.unique(mesh.point, return_index=True)
    for name, point, weight in zip(landmarks.names, landmarks.point, landmarks.weight, strict=True):
        material = _material_of_points(mesh, point)
        row = np.searchsorted(stage_points, point)
        at = weight.astype(np.float64) @ positions[first[row]].astype(np.float64)
        rows.append(
            {
                "name": name,
                "points": row.tolist(),
                "weights": [round(float(one), 6) for one in weight],
                "mesh": part_name(mesh.materials[material]),
                "vertices": _gltf_vertices(mesh, material, point).tolist(),
                "position_mm": [round(float(x), 3) for x in at],
            }
        )
    return rows


def _material_of_points(mesh: Mesh, points: Index) -> int:
    """Return the index of a material whose triangles have all of the points as corners."""
    corners = mesh.point[mesh.triangles]
    used = [set(mesh.material[(corners == point).any(axis=1)].tolist()) for point in np.unique(points)]
    return int(min(set.intersection(*used)))


def _gltf_vertices(mesh: Mesh, material: int, points: Index) -> Index:
    """Return the indices of points among the vertices of a material, in the order of `SurfacePrimitive`."""
    used = np.unique(mesh.triangles[mesh.material == material])
    order = np.argsort(mesh.point[used], kind="stable")
    return np.asarray(order[np.searchsorted(mesh.point[used], points, sorter=order)], np.int64)


def blend_shape_rows(target_names: tuple[str, ...]) -> list[dict[str, str | None]]:
    """Return the name of each morph target in ARKit, MediaPipe and Live Link Face; None where it has none."""
    return [
        {
            "name": name,
            "arkit": name,
            "mediapipe": None if name in _SHAPES_WITHOUT_MEDIAPIPE else name,
            "live_link_face": name[:1].upper() + name[1:],
        }
        for name in target_names
    ]
