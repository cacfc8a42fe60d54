"""Hair of people in glTF files of this package, grown again from the parameters in the file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
from scipy.spatial import cKDTree

from dermis.base.errors import notify
from dermis.formats.gltf.document import read_document
from dermis.human.model import Layout
from dermis.human.person import Human
from dermis.human.person_file import person_from_fields
from dermis.mesh.head import Head
from dermis.scene.smoothness import SubdivisionLevels

_SAME_MM, _SAME_UV = 0.05, 1e-4
_MAX_LEVELS = 3


def person_in_file(path: Path) -> Human | None:
    """Return the person whose parameters a .glb or .gltf file of this package contains; None for other files.

    Raises DermisError for invalid parameters.
    """
    asset = read_document(path).tree.get("asset")
    notes = asset.get("extras") if isinstance(asset, dict) else None
    stored = notes.get("person") if isinstance(notes, dict) else None
    if not isinstance(stored, dict) or not {"age", "targets", "skin", "hair"} <= stored.keys():
        return None
    return person_from_fields(path, stored)


def with_grown_hair(file_head: Head, person: Human, levels: SubdivisionLevels) -> Head | None:
    """Return the head of a person with the maps of a file; None, with a note, if the file has another shape.

    file_head : head as read from the file, before subdivision
    levels : levels of subdivision to add to those of the file, or a function that returns them for a head
    """
    for layout in get_args(Layout):
        for own_levels in range(_MAX_LEVELS + 1):
            own = person.head(layout=layout, subdivide=own_levels)
            if len(own.mesh.triangles) > len(file_head.mesh.triangles):
                break
            if _has_same_shape(own, file_head):
                added = levels(file_head) if callable(levels) else levels
                total = min(own_levels + added, _MAX_LEVELS)
                head = own if total == own_levels else person.head(layout=layout, subdivide=total)
                return replace(head, name=file_head.name, maps=file_head.maps)
    notify(f"{file_head.name}: its hair is left out, because its mesh is no longer that of the person")
    return None


def _has_same_shape(person_head: Head, file_head: Head) -> bool:
    """Return whether two heads have the same vertices and uv, in any order."""
    own, other = person_head.mesh, file_head.mesh
    if len(own.triangles) != len(other.triangles):
        return False
    sides = [np.concatenate([mesh.positions, mesh.uv * 1e3], axis=1) for mesh in (own, other)]
    scale = np.array([1.0, 1.0, 1.0, *[_SAME_MM / _SAME_UV * 1e-3] * 2])
    distance, _ = cKDTree(sides[0] * scale).query(sides[1] * scale)
    return bool(np.max(distance) < _SAME_MM)
