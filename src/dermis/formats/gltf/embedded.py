"""Reading of skin maps and eye parameters that are stored in glTF files."""

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

_READABLE_MIME_TYPES = {"image/png", "image/jpeg"}
EMBEDDED_ROLES = ("normal", "height", "specular", "roughness", "region")


def embedded_maps(path: Path) -> Tree:
    """Return keyword arguments of `load_maps` from the pictures in a .glb or .gltf file, {} without pictures.

    They are the base colour and the normal map of the skin's material. Files written by this package also
    store all maps in the material's extras; then the normal map is used only if the extras refer to it, as it
    may be computed from the height map for other programs.

    Raises DermisError when the file is damaged.
    """
    document = read_document(path)
    with parsing(path, "valid textures", *MALFORMED_DATA_ERRORS):
        options = _map_options(document)
    texels = 0
    for picture in (one for one in options.values() if isinstance(one, EmbeddedPicture) or is_file(str(one))):
        width, height = read_size(picture)
        texels += width * height
    if texels > MAX_TOTAL_PIXELS:
        advice = "Resize them, or set them by options (--colour, ...)"
        limit = f"textures of at most {MAX_TOTAL_PIXELS / 1e6:.0f} million texels together"
        refuse(path, limit, f"they have {texels / 1e6:.0f} million", advice)
    return options


def _map_options(document: Document) -> Tree:
    materials = document.items("materials") or [{}]
    skin = next((one for one in materials if "skin" in one.get("name", "").lower()), materials[0])

    def picture(reference: Tree | None) -> EmbeddedPicture | Path | None:
        if reference is None or reference.get("texCoord", 0) != 0:
            return None
        source = document.item("textures", reference["index"]).get("source")
        return None if source is None else _embedded_picture(document, source)

    options: Tree = {"colour": picture(skin.get("pbrMetallicRoughness", {}).get("baseColorTexture"))}
    extras = skin.get("extras", {}).get("dermis")
    if extras is None:
        options["normal"] = picture(skin.get("normalTexture"))
    else:
        options |= {role: picture(extras.get(role)) for role in EMBEDDED_ROLES}
        options["colour"] = picture(extras.get("colour")) or options["colour"]
        options["height_mm"] = _checked_relief(extras.get("height_mm"))
    return {role: value for role, value in options.items() if value is not None}


def _checked_relief(height_mm: object) -> float | None:
    """Return the relief of one grey level of an embedded 8-bit height map [mm], after checking its range."""
    if height_mm is None:
        return None
    number = height_mm if isinstance(height_mm, int | float) and not isinstance(height_mm, bool) else 0
    if not 0 < number <= MAX_RELIEF_MM:
        raise ValueError(f"height_mm is {str(height_mm)[:40]!r}, not above 0 and up to {MAX_RELIEF_MM:g}")
    return float(number)


def _embedded_picture(document: Document, source: int) -> EmbeddedPicture | Path | None:
    image = document.item("images", source)
    name = f"{document.path}, image {image.get('name', source)}"
    if "bufferView" in image:
        if image.get("mimeType") not in _READABLE_MIME_TYPES:
            return None
        return EmbeddedPicture(name, bytes(document.read_view(image["bufferView"])))
    uri = image["uri"]
    if uri.startswith("data:"):
        kind, _, text = uri[5:].partition(";base64,")
        return EmbeddedPicture(name, base64.b64decode(text)) if kind in _READABLE_MIME_TYPES else None
    file = resolve_uri(document.path, uri)
    return file if file.suffix.lower() in (".png", ".jpg", ".jpeg") else None


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
