"""Materials with their pictures, and eye parameters, of glTF files."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

from dermis.base.errors import error_context, refuse
from dermis.base.reading import MALFORMED_DATA_ERRORS, is_file, parsing
from dermis.formats.gltf.document import read_document
from dermis.formats.gltf.read_materials import read_materials
from dermis.formats.materials import FileMaterial
from dermis.images.io import EmbeddedPicture, read_size
from dermis.images.sizes import MAX_TOTAL_PIXELS
from dermis.mesh.eye_look import EyeLook


def embedded_materials(path: Path) -> tuple[FileMaterial, ...]:
    """Return the materials of a .glb or .gltf file, with their pictures.

    Raises DermisError when the file is damaged, or when its pictures are too large.
    """
    document = read_document(path)
    with parsing(path, "valid textures", *MALFORMED_DATA_ERRORS):
        materials = read_materials(document)
    pictures: dict[tuple[str, str], object] = {}
    for material in materials:
        used = dict(material.maps or {}) | {role: one.picture for role, one in material.textures.items()}
        pictures |= {(role, str(picture)): picture for role, picture in used.items()}
    texels = 0
    for picture in pictures.values():
        if isinstance(picture, EmbeddedPicture) or (isinstance(picture, Path) and is_file(str(picture))):
            width, height = read_size(picture)
            texels += width * height
    if texels > MAX_TOTAL_PIXELS:
        advice = "Resize them, or set them by options (--colour, ...)"
        limit = f"textures of at most {MAX_TOTAL_PIXELS / 1e6:.0f} million texels together"
        refuse(path, limit, f"they have {texels / 1e6:.0f} million", advice)
    return materials


def embedded_eye_look(path: Path) -> EyeLook:
    """Return the eye parameters in the person description of a .glb or .gltf file, or the defaults.

    Raises DermisError for invalid parameters.
    """
    notes = read_document(path).tree.get("asset", {}).get("extras")
    person = notes.get("person") if isinstance(notes, dict) else None
    eyes = person.get("eyes") if isinstance(person, dict) else None
    if not isinstance(eyes, dict):
        return EyeLook()
    values = {one.name: eyes[one.name] for one in fields(EyeLook) if one.name in eyes}
    with error_context(path), parsing(path, "valid eye parameters", *MALFORMED_DATA_ERRORS):
        return EyeLook(**values)
