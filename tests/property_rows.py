"""Loading of files before and after a change, and the treatment of the changed property."""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import astuple, fields, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dermis.base.errors import DermisError
from dermis.base.file_properties import FileProperty, Treatment
from dermis.formats.parts import DEFAULT_COLOUR
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.scene.heads import load_head


class Loaded(NamedTuple):
    """Result of loading a file: digest of the head, notes, and the error."""

    digest: str
    notes: str
    error: str


def loaded(path: Path, unit_mm: float | None = None) -> Loaded:
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        try:
            head = load_head(path, subdivide=0, unit_mm=unit_mm)
        except DermisError as error:
            return Loaded("", "", str(error))
    return Loaded(digest_of(head), "\n".join(str(note.message) for note in notes), "")


def load_quietly(path: Path, unit_mm: float = 1000.0) -> Head:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return load_head(path, subdivide=0, unit_mm=unit_mm)


def digest_of(head: Head) -> str:
    """Return a digest of all that is drawn: a map of colours replaces the colour of skin materials."""
    replaced = {"skin"} if head.maps.colour is not None else set()
    own = [
        replace(one, colour=DEFAULT_COLOUR) if one.kind in replaced else one for one in head.mesh.materials
    ]
    digest = hashlib.sha256(repr([astuple(one) for one in own]).encode())
    arrays = [head.mesh.positions, head.mesh.normals, head.mesh.uv, head.mesh.triangles, head.mesh.material]
    arrays += [getattr(head.maps, one.name) for one in fields(Maps) if one.name != "parts"]
    parts = head.maps.parts
    arrays += [] if parts is None else [parts.colour, parts.surface, parts.emission]
    rig = head.rig
    arrays += [] if rig is None else [rig.positions_mm, rig.targets.delta_mm]
    if rig is not None:
        skeleton = rig.skeleton
        digest.update(repr((rig.targets.names, None if skeleton is None else skeleton.names)).encode())
    for array in arrays:
        digest.update(b"none" if array is None else np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def treatment(before: Loaded, after: Loaded) -> Treatment:
    """Return the treatment of a change of a file."""
    assert not before.error, before.error
    if after.error:
        return "refused"
    noted = bool(set(after.notes.splitlines()) - set(before.notes.splitlines()))
    if after.digest != before.digest:
        return "drawn with a note" if noted else "drawn"
    return "noted" if noted else "no effect"


def row_named(properties: tuple[FileProperty, ...], name: str) -> FileProperty:
    """Return the property whose name has a beginning, which only one has."""
    (found,) = [one for one in properties if one.name == name] or [
        one for one in properties if one.name.startswith(name)
    ]
    return found


def names_of(properties: tuple[FileProperty, ...]) -> set[str]:
    return {one.name for one in properties}
