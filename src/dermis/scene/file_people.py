"""Hair of people in glTF files of this package, grown again from the parameters stored in the file."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
from scipy.spatial import cKDTree

from dermis.base.arrays import Doubles
from dermis.base.errors import DermisError, notify
from dermis.formats.gltf.document import read_document
from dermis.human.model import Layout
from dermis.human.person import Human
from dermis.human.person_file import person_from_fields
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.subdivide import MAX_SUBDIVISION_LEVELS
from dermis.scene.smoothness import SubdivisionLevels

_SAME_MM, _SAME_UV = 0.05, 1e-4  # largest differences between vertices that count as equal


def person_in_file(path: Path) -> Human | None:
    """Return the person whose parameters a .glb or .gltf file of this package contains; None for other files.

    For invalid parameters, the result is None, with a note.
    """
    asset = read_document(path).tree.get("asset")
    extras = asset.get("extras") if isinstance(asset, dict) else None
    stored = extras.get("person") if isinstance(extras, dict) else None
    if not isinstance(stored, dict) or not {"age", "targets", "skin", "hair"} <= stored.keys():
        return None
    try:
        return person_from_fields(path, stored)
    except DermisError as fault:
        _notify_without_hair(path, f"the parameters of its person are invalid ({fault})")
        return None


def with_grown_hair(
    file_head: Head, levels: SubdivisionLevels, mesh_options: Collection[str] = ()
) -> Head | None:
    """Return the head of the person in a glTF file, with the maps of the file; None for files without one.

    The result is also None, with a note, if the file does not show the person at rest or has other vertices,
    morph targets or bones than the person.

    file_head : head as read from the file, before subdivision
    levels : levels of subdivision to add to those of the file, or a function that returns them for a head
    mesh_options : names of the options that change how the mesh of the file is read
    """
    name = file_head.name
    if (person := person_in_file(Path(name))) is None:
        return None
    if mesh_options:
        _notify_without_hair(name, f"{', '.join(mesh_options)} changes how its mesh is read")
        return None
    if file_head.control_rig.targets.rest is not None:
        _notify_without_hair(name, "the default weights of its morph targets are not 0")
        return None
    for layout in get_args(Layout):
        for file_levels in range(MAX_SUBDIVISION_LEVELS + 1):
            own = person.head(layout=layout, subdivide=file_levels)
            if len(own.mesh.triangles) > len(file_head.mesh.triangles):
                break
            if _has_same_shape(own, file_head):
                added = levels(file_head) if callable(levels) else levels
                total = min(file_levels + added, MAX_SUBDIVISION_LEVELS)
                if total < file_levels + added and not callable(levels):
                    notify(f"{name}: it has {total} levels of subdivision, {file_levels} of them in its file")
                head = own if total == file_levels else person.head(layout=layout, subdivide=total)
                return replace(head, name=name, maps=file_head.maps)
    _notify_without_hair(name, "its mesh, morph targets or bones are no longer those of the person")
    return None


def _notify_without_hair(file_name: str | Path, reason: str) -> None:
    notify(f"{file_name}: its hair is left out, because {reason}")


def _has_same_shape(person_head: Head, file_head: Head) -> bool:
    """Return whether two heads have the same vertices, uv of skin, names of morph targets and names of bones.

    The order does not matter. The uv of eyes differ, because files contain pictures of painted eyes.
    """
    own, other = person_head.mesh, file_head.mesh
    if len(own.triangles) != len(other.triangles):
        return False
    if {*person_head.targets} != {*file_head.targets} or {*person_head.bones} != {*file_head.bones}:
        return False
    return all(
        _rows_agree(*(_vertex_rows(mesh, of_skin) for mesh in (own, other))) for of_skin in (True, False)
    )


def _vertex_rows(mesh: Mesh, of_skin: bool) -> Doubles:
    """Return positions (n, 3) of the vertices of skin with their uv (n, 2), or only positions of other parts.

    The uv are scaled so that the largest difference that counts as equal is that of positions.
    """
    is_skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
    vertex = np.unique(mesh.triangles[is_skin == of_skin])
    positions = mesh.positions[vertex].astype(np.float64)
    return (
        np.concatenate([positions, mesh.uv[vertex] * (_SAME_MM / _SAME_UV)], axis=1) if of_skin else positions
    )


def _rows_agree(own: Doubles, other: Doubles) -> bool:
    """Return whether each row of `other` (n, k) is near a row of `own` (m, k)."""
    if not len(own) or not len(other):
        return len(own) == len(other)
    return bool(np.max(cKDTree(own).query(other)[0]) < _SAME_MM)
