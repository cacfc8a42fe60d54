"""Reading of materials with their pictures, and of eye parameters, from glTF files."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from dermis.base.errors import error_context
from dermis.base.reading import MALFORMED_DATA_ERRORS, refuse_parse_errors
from dermis.formats.gltf.document import read_document
from dermis.formats.gltf.read_materials import read_materials
from dermis.formats.materials import FileMaterial, check_pictures
from dermis.mesh.eye_look import EyeLook


def embedded_materials(path: Path) -> tuple[FileMaterial, ...]:
    """Return the materials of a .glb or .gltf file, with their pictures.

    Raises DermisError when the file is damaged, or when its pictures are too large.
    """
    document = read_document(path)
    with refuse_parse_errors(path, "valid textures", *MALFORMED_DATA_ERRORS):
        materials = read_materials(document)
    check_pictures(path, materials)
    return materials


def embedded_eye_look(path: Path) -> EyeLook:
    """Return the eye parameters that this package stored in a .glb or .gltf file; defaults for other files.

    Raises DermisError for invalid parameters.
    """
    asset = read_document(path).tree.get("asset")
    notes = asset.get("extras") if isinstance(asset, dict) else None
    person = notes.get("person") if isinstance(notes, dict) else None
    eyes = person.get("eyes") if isinstance(person, dict) else None
    if not isinstance(eyes, dict):
        return EyeLook()
    values = {one.name: eyes[one.name] for one in fields(EyeLook) if one.name in eyes}
    with error_context(path), refuse_parse_errors(path, "valid eye parameters", *MALFORMED_DATA_ERRORS):
        return EyeLook(**values)
