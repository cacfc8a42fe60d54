"""What this package wrote into a glTF file for itself."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from dermis.base.errors import about
from dermis.base.reading import BROKEN, understood
from dermis.mesh.eyes import EyeLook
from dermis.mesh.gltf.document import read_document


def told_eyes(path: Path) -> EyeLook:
    """What a .glb or .gltf file tells of the eyes of its person; the usual look for others.

    Raises DermisError for such that no eyes can have.
    """
    notes = read_document(path).tree.get("asset", {}).get("extras")
    person = notes.get("person") if isinstance(notes, dict) else None
    eyes = person.get("eyes") if isinstance(person, dict) else None
    if not isinstance(eyes, dict):
        return EyeLook()
    told = {one.name: eyes[one.name] for one in fields(EyeLook) if one.name in eyes}
    with about(path), understood(path, "sound numbers of eyes", *BROKEN):
        return EyeLook(**told)
