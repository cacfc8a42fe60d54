"""Maps and eyes that a glTF file holds for this package."""

from __future__ import annotations

import base64
from dataclasses import fields
from pathlib import Path

from dermis.base.errors import error_context, refuse
from dermis.base.reading import MALFORMED_DATA_ERRORS, is_file, parsing
from dermis.formats.gltf.document import Document, Tree, read_document
from dermis.formats.referenced_files import resolve_uri
from dermis.formats.size_limits import MAX_RELIEF_MM
from dermis.images.io import EmbeddedPicture, read_size
from dermis.images.sizes import MAX_TOTAL_PIXELS
from dermis.mesh.eye_look import EyeLook

_READABLE = {"image/png", "image/jpeg"}
ROLES = ("normal", "height", "specular", "roughness", "region")


def embedded_maps(path: Path) -> Tree:
    """Options of `load_maps` that a .glb or .gltf file gives itself, {} for one without pictures.

    The skin's material gives its base colour and, when the package wrote the file, the maps that its extras
    name: a normal map only where it is no picture of the height; any other file gives its normal map.

    Raises DermisError when the file is damaged.
    """
    document = read_document(path)
    with parsing(path, "sound textures", *MALFORMED_DATA_ERRORS):
        found = _maps(document)
    texels = 0
    for picture in (one for one in found.values() if isinstance(one, EmbeddedPicture) or is_file(str(one))):
        width, height = read_size(picture)
        texels += width * height
    if texels > MAX_TOTAL_PIXELS:
        actual, advice = (
            f"they have {texels / 1e6:.0f} million",
            "Resize them, or name them yourself (--colour, ...)",
        )
        refuse(
            path, f"textures of at most {MAX_TOTAL_PIXELS / 1e6:.0f} million texels together", actual, advice
        )
    return found


def _maps(document: Document) -> Tree:
    materials = document.items("materials") or [{}]
    skin = next((one for one in materials if "skin" in one.get("name", "").lower()), materials[0])

    def picture(reference: Tree | None) -> EmbeddedPicture | Path | None:
        if reference is None or reference.get("texCoord", 0) != 0:
            return None
        source = document.item("textures", reference["index"]).get("source")
        return None if source is None else _picture(document, source)

    found: Tree = {"colour": picture(skin.get("pbrMetallicRoughness", {}).get("baseColorTexture"))}
    own = skin.get("extras", {}).get("dermis")
    if own is None:
        found["normal"] = picture(skin.get("normalTexture"))
    else:
        found |= {role: picture(own.get(role)) for role in ROLES}
        found["colour"] = picture(own.get("colour")) or found["colour"]
        found["height_mm"] = _checked_relief(own.get("height_mm"))
    return {role: value for role, value in found.items() if value is not None}


def _checked_relief(height_mm: object) -> float | None:
    """The relief of a grey level [mm] that a file tells."""
    if height_mm is None:
        return None
    if (
        isinstance(height_mm, bool)
        or not isinstance(height_mm, int | float)
        or not 0 < height_mm <= MAX_RELIEF_MM
    ):
        raise ValueError(
            f"height_mm is {str(height_mm)[:40]!r}, not a number above 0 and up to {MAX_RELIEF_MM:g}"
        )
    return float(height_mm)


def _picture(document: Document, source: int) -> EmbeddedPicture | Path | None:
    image = document.item("images", source)
    name = f"{document.path}, image {image.get('name', source)}"
    if "bufferView" in image:
        if image.get("mimeType") not in _READABLE:
            return None
        return EmbeddedPicture(name, bytes(document.read_view(image["bufferView"])))
    uri = image["uri"]
    if uri.startswith("data:"):
        kind, _, text = uri[5:].partition(";base64,")
        return EmbeddedPicture(name, base64.b64decode(text)) if kind in _READABLE else None
    file = resolve_uri(document.path, uri)
    return file if file.suffix.lower() in (".png", ".jpg", ".jpeg") else None


def embedded_eye_look(path: Path) -> EyeLook:
    """What a .glb or .gltf file tells of the eyes of its person; the usual look for others.

    Raises DermisError for such that no eyes can have.
    """
    notes = read_document(path).tree.get("asset", {}).get("extras")
    person = notes.get("person") if isinstance(notes, dict) else None
    eyes = person.get("eyes") if isinstance(person, dict) else None
    if not isinstance(eyes, dict):
        return EyeLook()
    told = {one.name: eyes[one.name] for one in fields(EyeLook) if one.name in eyes}
    with error_context(path), parsing(path, "sound numbers of eyes", *MALFORMED_DATA_ERRORS):
        return EyeLook(**told)
