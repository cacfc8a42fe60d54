"""Label classes of hairs and meshes; on the skin, the borders of classes are given by signed distances."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from functools import cache
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Floats
from dermis.human.hair import brows
from dermis.human.hair.density import height_above_hairline
from dermis.human.labels.classes import class_number
from dermis.human.regions.average import AVERAGE_HUMAN, average_head, is_human, quads_of_parts
from dermis.human.regions.labels import known_landmarks, warp_to_average
from dermis.human.regions.region_table import neck_distance_mm, nose_distance_mm, torso_distance_mm
from dermis.human.skin.surface import BORDER_FIELDS, average_surface, lid_rings
from dermis.mesh.eyeball import LIMBUS_MM
from dermis.mesh.head import Head
from dermis.mesh.mesh import Material
from dermis.mesh.strands import quad_corners

Doubles = NDArray[np.float64]

HUMAN_FIELD_CLASSES = (
    "right_ear",
    "left_ear",
    "mouth_interior",
    "upper_lip",
    "lower_lip",
    "right_eye",
    "left_eye",
    "nose",
    "right_brow",
    "left_brow",
    "torso",
    "neck",
)
"""Label classes of the skin, in order of precedence."""
LIP_SEAM_MM = np.array([[0.0, -67.3], [10, -66.7], [18, -67.2], [22.2, -67.9]])
"""Polyline where the lips meet: distance from the middle of the face, and height [mm]."""
_FIELD_OUTSIDE_CLASS_MM = -1.0
_MIN_BROW_Z_MM = -30.0  # minimum z of brows
_HAIRLINE_MARGIN_MM = -8.0  # height relative to the hairline below which hair belongs to the beard
_DENSE_SUBDIVISION_LEVELS = 2
SIDE_NAMES = "right", "left"
_CLASS_OF_MATERIAL = {"upper teeth": "teeth", "lower teeth": "teeth", "tongue": "tongue"}
_MAX_CACHED_TOPOLOGIES = 3
_LABEL_CACHE_LOCK = Lock()


@cache
def label_fields() -> Doubles:
    """Return signed distances (k, p) of control points to the borders of `HUMAN_FIELD_CLASSES` [mm].

    Distances are positive inside a class.
    """
    points = average_head().positions_mm.astype(np.float64)
    distances = np.full((len(BORDER_FIELDS), len(points)), -_FIELD_OUTSIDE_CLASS_MM)
    distances[:, : len(average_surface()[1])] = average_surface()[1].T
    lips, mouth, lids = distances
    left = points[:, 0] > 0
    above = points[:, 1] - np.interp(np.abs(points[:, 0]), *LIP_SEAM_MM.T)
    fields = {
        "mouth_interior": -mouth,
        "upper_lip": np.minimum(lips, above),
        "lower_lip": np.minimum(lips, -above),
        "nose": nose_distance_mm(points),
        "neck": neck_distance_mm(points),
        "torso": torso_distance_mm(points),
    }
    for name, values in (("ear", _ear_field()), ("eye", -lids), ("brow", _brow_field(points))):
        fields[f"left_{name}"] = np.where(left, values, _FIELD_OUTSIDE_CLASS_MM)
        fields[f"right_{name}"] = np.where(left, _FIELD_OUTSIDE_CLASS_MM, values)
    return np.stack([fields[name] for name in HUMAN_FIELD_CLASSES])


def dense_label_fields() -> tuple[Doubles, Doubles]:
    """Return points (n, 3) on the average human's outer skin, and their label fields (k, n) [mm].

    The fields are the signed distances of `label_fields` at the points of a subdivided mesh.
    """
    head = AVERAGE_HUMAN.head(subdivide=_DENSE_SUBDIVISION_LEVELS)
    assert head.control_rig.stencils is not None
    skin = np.unique(head.mesh.point[head.mesh.triangles[head.mesh.material == 0]])
    fields = head.control_rig.stencils.points(label_fields().T.copy())[skin].T
    outer = fields[HUMAN_FIELD_CLASSES.index("mouth_interior")] < 0
    return head.mesh.points_mm[skin][outer], fields[:, outer]


def hair_classes(head: Head) -> NDArray[np.uint8]:
    """Return the label class (n,) of each hair of a head: brows and lashes first, then scalp and beard.

    If the mesh is not that of the parametric human, all hairs have the class "hair".
    """
    quads = {}
    if head.strands is not None:
        quads["fine"] = head.strands.roots.quad >> (2 * head.levels)
    if head.hair is not None:
        quads["coarse"] = head.hair.roots.roots.quad >> (2 * head.levels)
    if not quads:
        return np.zeros(0, np.uint8)
    tables = dict(zip(("fine", "coarse"), _quad_hair_classes(), strict=True))
    if max(int(one.max(initial=0)) for one in quads.values()) >= len(tables["fine"]):
        return np.full(sum(map(len, quads.values())), class_number("hair"), np.uint8)
    return np.concatenate([tables[kind][one] for kind, one in quads.items()])


@cache
def _quad_hair_classes() -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return for each control quad the label classes of hairs rooted there, as two arrays (q,).

    The first array is for fine hair, which is brow or lashes; the second is for scalp hair or beard.
    """
    mesh = average_head().mesh
    around = quad_corners(mesh, np.arange(len(mesh.quads)))
    middle = average_head().positions_mm.astype(np.float64)[around].mean(axis=1)
    lids = np.isin(around, lid_rings()).any(axis=1)
    names = "right_brow", "left_brow", "lashes", "hair", "beard"
    right, left, lashes, hair, beard = map(class_number, names)
    fine = np.where(lids, lashes, np.where(middle[:, 0] > 0, left, right))
    coarse = np.where(height_above_hairline(middle) > _HAIRLINE_MARGIN_MM, hair, beard)
    return fine.astype(np.uint8), coarse.astype(np.uint8)


def _ear_field() -> Doubles:
    """Return a field (p,) over control points whose zero crossing is the border of the ears, positive inside.

    The field is the fraction of the adjacent quads that belong to an ear, minus 0.5.
    """
    mesh = average_head().mesh
    around = quad_corners(mesh, np.arange(len(mesh.quads)))
    within = np.zeros(len(around))
    within[quads_of_parts()["ears"]] = 1.0
    count = len(average_head().positions_mm)
    quad_values = within, np.ones(len(around))
    ears, quads = (np.bincount(around.ravel(), np.repeat(values, 4), count) for values in quad_values)
    return np.asarray(ears / np.maximum(quads, 1.0) - 0.5)


def _brow_field(points: Doubles) -> Doubles:
    """Return the signed distance (p,) of points (p, 3) to the brow outlines, positive inside [mm].

    It is the smallest of the signed distances to the four edges of the brow, measured in x and y only.
    """
    x, y = np.abs(points[:, 0]), points[:, 1]
    low, high = (brows.brow_outline(side) for side in (-1.0, 1.0))
    ends = 0.5 * (low + high)
    below, above = (np.interp(x, *side.T) for side in (low, high))
    across = np.minimum(np.minimum(y - below, above - y), np.minimum(x - ends[0, 0], ends[-1, 0] - x))
    return np.where(points[:, 2] > _MIN_BROW_Z_MM, across, _FIELD_OUTSIDE_CLASS_MM)


_LABEL_CACHE: dict[bytes, MeshLabels] = {}


class MeshLabels(NamedTuple):
    """Label classes of a mesh; borders between classes may cross triangles.

    base : (t,) class of each triangle where no field is positive
    classes : (k,) class of each field; a surface point has the class of its first positive field
    fields : (v, k) signed distances of the vertices to the class borders, positive inside, interpolated
        linearly over the triangles [mm]
    """

    base: NDArray[np.uint8]
    classes: NDArray[np.uint8]
    fields: Floats


def mesh_labels(head: Head) -> MeshLabels:
    """Return the label classes of a head; for parametric humans the result is cached by mesh topology."""
    if head.undressed is not None:
        return _with_worn_labels(head, mesh_labels(head.undressed))
    if not is_human(head):
        return _build_mesh_labels(head)
    digest = hashlib.blake2b(head.mesh.triangles.tobytes(), digest_size=16).digest()
    key = digest + bytes([head.strands is not None])
    with _LABEL_CACHE_LOCK:
        if key not in _LABEL_CACHE:
            while len(_LABEL_CACHE) >= _MAX_CACHED_TOPOLOGIES:
                _LABEL_CACHE.pop(next(iter(_LABEL_CACHE)))
            _LABEL_CACHE[key] = _build_mesh_labels(head)
        return _LABEL_CACHE[key]


def _with_worn_labels(head: Head, body_labels: MeshLabels) -> MeshLabels:
    """Return the label classes of a dressed head.

    body_labels : label classes of the head without clothing and glasses
    """
    base, classes, fields = body_labels
    worn = head.mesh.material[len(base) :]
    class_of_material = [class_number(one.label) if one.label else 0 for one in head.mesh.materials]
    outside = np.full((len(head.mesh.positions) - len(fields), len(classes)), _FIELD_OUTSIDE_CLASS_MM)
    return MeshLabels(
        np.concatenate([base, np.array(class_of_material, np.uint8)[worn]]),
        classes,
        np.concatenate([fields, outside.astype(np.float32)]),
    )


def _build_mesh_labels(head: Head) -> MeshLabels:
    material_classes = np.array([class_number(_material_class(one)) for one in head.mesh.materials], np.uint8)
    for material, side in zip(
        () if head.eyes is None else head.eyes.material, reversed(SIDE_NAMES), strict=False
    ):
        material_classes[material] = class_number(f"{side}_eye")
    fields = _iris_fields(head.template or head) | _skin_fields(head)
    no_fields = np.zeros((int(head.mesh.point.max()) + 1, 0))
    points = np.stack(list(fields.values()), axis=1) if fields else no_fields
    classes = np.array([class_number(name) for name in fields], np.uint8)
    values = np.ascontiguousarray(points[head.mesh.point], np.float32)
    return MeshLabels(material_classes[head.mesh.material], classes, values)


def _material_class(material: Material) -> str:
    """Return the name of the label class of a material; eyeballs are labelled separately."""
    known = _CLASS_OF_MATERIAL.get(material.part or material.name)
    return known or ("skin" if material.kind == "skin" else "other")


def _iris_fields(head: Head) -> dict[str, Doubles]:
    """Return the signed distances (p,) of the head's points to the border of each iris [mm].

    The keys are the label classes of the two irises. Distances are positive inside the iris, and scaled as if
    the eye had average size. All points that are not on the front of the eyeball get the value -1, so that
    they count as outside.
    """
    if head.eyes is None:
        return {}
    mesh, points = head.mesh, head.mesh.points_mm
    fields = {}
    frames = head.eyes.eye_matrices(head.control_rig, head.control_rig.rest)
    for frame, material, side in zip(frames, head.eyes.material, reversed(SIDE_NAMES), strict=False):
        eyeball_points = np.unique(mesh.point[mesh.triangles[mesh.material == material]])
        local = points[eyeball_points] @ frame[:3, :3].T + frame[:3, 3]
        inside = np.where(
            local[:, 2] > 0, LIMBUS_MM - np.hypot(local[:, 0], local[:, 1]), _FIELD_OUTSIDE_CLASS_MM
        )
        fields[f"{side}_iris"] = np.full(len(points), _FIELD_OUTSIDE_CLASS_MM)
        fields[f"{side}_iris"][eyeball_points] = inside
    return fields


def _skin_fields(head: Head) -> dict[str, Doubles]:
    """Return the signed distances (p,) of the head's points to the borders of parts of the skin [mm].

    The keys are the label classes of these parts, such as lips, brows and ears. Distances are positive inside
    a part. All points that are not on the skin get the value -1 at any distance, so that they count
    as outside.
    """
    mesh = head.mesh
    count = int(mesh.point.max()) + 1
    if is_human(head):
        stencils = head.control_rig.stencils
        refined: Callable[[Doubles], Doubles] = stencils.points if stencils else lambda values: values
        fields = dict(zip(HUMAN_FIELD_CLASSES, refined(label_fields().T.copy()).T, strict=True))
    elif (landmarks := known_landmarks(head)) is not None:
        fields = _warped_fields(head, landmarks)
    else:
        return {}
    if head.strands is None:
        fields = {name: values for name, values in fields.items() if not name.endswith("brow")}
    is_skin = np.array([material.kind == "skin" for material in mesh.materials])
    outside = np.ones(count, bool)
    outside[mesh.point[mesh.triangles[is_skin[mesh.material]]]] = False
    return {name: np.where(outside, _FIELD_OUTSIDE_CLASS_MM, values) for name, values in fields.items()}


def _warped_fields(head: Head, landmarks: Mapping[str, tuple[float, float, float]]) -> dict[str, Doubles]:
    """Return the label fields (p,) of a head that is not a parametric human, by class name [mm].

    The landmarks define a warp from the head to the average human. Each point of the head gets the fields of
    the average human at the nearest point to its warped position.
    """
    from scipy.spatial import cKDTree

    points = head.mesh.points_mm
    average, values = dense_label_fields()
    _, near = cKDTree(average).query(warp_to_average(head, landmarks, points))
    return {name: values[k][near] for k, name in enumerate(HUMAN_FIELD_CLASSES) if not name.endswith("_eye")}
