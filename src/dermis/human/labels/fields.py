"""How a mesh is labelled: a class for each triangle, and distances by which parts of them are of others."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Floats
from dermis.human.labels.classes import class_number
from dermis.human.labels.of_human import HUMAN_FIELDS, human_fields
from dermis.human.regions.average import is_human
from dermis.human.regions.labels import known_landmarks, to_average
from dermis.mesh.eyeball import LIMBUS_MM
from dermis.mesh.head import Head
from dermis.mesh.mesh import Material
from dermis.mesh.strands import points_of

Doubles = NDArray[np.float64]

SIDES = "right", "left"
_OUTSIDE = -1.0
_PARTS = {"upper teeth": "teeth", "lower teeth": "teeth", "tongue": "tongue", "cut": "neck"}
_MOST_KEPT = 3
_KEPT: dict[bytes, Labelling] = {}
_ALONE = Lock()


class Labelling(NamedTuple):
    """What a mesh shows where.

    base : (t,) class of each triangle
    classes : (k,) of the fields: of those that are above 0 at a place, the first one counts, else the base
    fields : (v, k) at the mesh's vertices, linear between these [mm, positive inside]
    """

    base: NDArray[np.uint8]
    classes: NDArray[np.uint8]
    fields: Floats


def labelling(head: Head) -> Labelling:
    """The labelling of a head; of parametric humans the same for all of one layout and level."""
    if not is_human(head):
        return _labelling(head)
    key = hashlib.blake2b(head.mesh.triangles.tobytes(), digest_size=16).digest() + bytes(
        [head.strands is not None]
    )
    with _ALONE:
        if key not in _KEPT:
            while len(_KEPT) >= _MOST_KEPT:
                _KEPT.pop(next(iter(_KEPT)))
            _KEPT[key] = _labelling(head)
        return _KEPT[key]


def _labelling(head: Head) -> Labelling:
    of_material = np.array([class_number(_named(one)) for one in head.mesh.materials], np.uint8)
    for material, side in zip(() if head.eyes is None else head.eyes.material, reversed(SIDES), strict=False):
        of_material[material] = class_number(f"{side}_eye")
    fields = _irises(head.template or head) | _skin(head)
    none = np.zeros((int(head.mesh.point.max()) + 1, 0))
    points = np.stack(list(fields.values()), axis=1) if fields else none
    classes = np.array([class_number(name) for name in fields], np.uint8)
    return Labelling(
        of_material[head.mesh.material], classes, np.ascontiguousarray(points[head.mesh.point], np.float32)
    )


def _named(material: Material) -> str:
    """Class of what is made of it, were it no eyeball."""
    known = _PARTS.get(material.part or material.name)
    return known or ("skin" if material.kind == "skin" else "other")


def _irises(head: Head) -> dict[str, Doubles]:
    """How far inside the limbus points of eyeballs are [mm of a usual eye]."""
    if head.eyes is None:
        return {}
    mesh, places = head.mesh, points_of(head.mesh)
    found = {}
    frames = head.eyes.frames(head.control, head.control.rest)
    for frame, material, side in zip(frames, head.eyes.material, reversed(SIDES), strict=False):
        own = np.unique(mesh.point[mesh.triangles[mesh.material == material]])
        local = places[own] @ frame[:3, :3].T + frame[:3, 3]
        inside = np.where(local[:, 2] > 0, LIMBUS_MM - np.hypot(local[:, 0], local[:, 1]), _OUTSIDE)
        found[f"{side}_iris"] = np.full(len(places), _OUTSIDE)
        found[f"{side}_iris"][own] = inside
    return found


def _skin(head: Head) -> dict[str, Doubles]:
    """How far inside of each part of the face points of the skin are [mm]."""
    mesh = head.mesh
    count = int(mesh.point.max()) + 1
    if is_human(head):
        stencils = head.control.stencils
        refined: Callable[[Doubles], Doubles] = stencils.points if stencils else lambda values: values
        fields = dict(zip(HUMAN_FIELDS, refined(human_fields().T.copy()).T, strict=True))
    elif (places := known_landmarks(head)) is not None:
        fields = _warped(head, places)
    else:
        return {}
    if head.strands is None:
        fields = {name: values for name, values in fields.items() if not name.endswith("brow")}
    kinds = np.array([material.kind == "skin" for material in mesh.materials])
    off = np.ones(count, bool)
    off[mesh.point[mesh.triangles[kinds[mesh.material]]]] = False
    return {name: np.where(off, _OUTSIDE, values) for name, values in fields.items()}


def _warped(head: Head, places: Mapping[str, tuple[float, float, float]]) -> dict[str, Doubles]:
    """Those of the point of the average human where landmarks take each point."""
    from scipy.spatial import cKDTree

    from dermis.human.labels.of_human import dense_fields

    points = points_of(head.mesh)
    average, values = dense_fields()
    _, near = cKDTree(average).query(to_average(head, places, points))
    return {name: values[k][near] for k, name in enumerate(HUMAN_FIELDS) if not name.endswith("_eye")}
