"""The pictures that a glTF file brings with it."""

from __future__ import annotations

import base64
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from dermis.errors import refuse
from dermis.images.io import Picture
from dermis.mesh.gltf.document import Document, read_document

_READABLE = {"image/png", "image/jpeg"}
ROLES = ("normal", "height", "specular", "roughness", "region")


def embedded_maps(path: Path) -> dict[str, Any]:
    """Options of `load_maps` that a .glb or .gltf file gives itself, {} for one without pictures.

    The skin's material gives its base colour and, when the package wrote the file, the maps that its extras
    name: a normal map only where it is no picture of the height; any other file gives its normal map.

    Raises DermisError when the file is damaged.
    """
    try:
        return _maps(read_document(path))
    except (KeyError, IndexError, ValueError, TypeError, AttributeError, struct.error, OSError) as fault:
        detail = f"{type(fault).__name__}: {fault}".splitlines()[0][:200]
        refuse(path, "sound textures", f"they cannot be read ({detail})", "Export the file again")


def _maps(document: Document) -> dict[str, Any]:
    materials = document.all("materials") or [{}]
    skin = next((one for one in materials if "skin" in one.get("name", "").lower()), materials[0])

    def picture(reference: dict[str, Any] | None) -> Picture | Path | None:
        if reference is None or reference.get("texCoord", 0) != 0:
            return None
        source = document.tree["textures"][reference["index"]].get("source")
        return None if source is None else _picture(document, source)

    found: dict[str, Any] = {"colour": picture(skin.get("pbrMetallicRoughness", {}).get("baseColorTexture"))}
    own = skin.get("extras", {}).get("dermis")
    if own is None:
        found["normal"] = picture(skin.get("normalTexture"))
    else:
        found |= {role: picture(own.get(role)) for role in ROLES}
        found["height_mm"] = own.get("height_mm")
    return {role: value for role, value in found.items() if value is not None}


def _picture(document: Document, source: int) -> Picture | Path | None:
    image = document.tree["images"][source]
    name = f"{document.path}, image {image.get('name', source)}"
    if "bufferView" in image:
        if image.get("mimeType") not in _READABLE:
            return None
        return Picture(name, bytes(document.view(image["bufferView"])))
    uri = image["uri"]
    if uri.startswith("data:"):
        kind, _, text = uri[5:].partition(";base64,")
        return Picture(name, base64.b64decode(text)) if kind in _READABLE else None
    file = document.path.parent / unquote(uri)
    return file if file.suffix.lower() in (".png", ".jpg", ".jpeg") else None
