"""The pictures that a glTF file brings along."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from dermis.errors import refuse
from dermis.images.io import Picture

_READABLE = {"image/png", "image/jpeg"}
ROLES = ("height", "specular", "roughness", "region")


def embedded_maps(path: Path) -> dict[str, Any]:
    """Options of `load_maps` that a .glb or .gltf file itself answers, {} for one without pictures.

    The skin's material gives its base colour and, when the package wrote the file, the height, specular,
    roughness and region maps of its extras; any other file gives its normal map.

    Raises DermisError when the file is damaged.
    """
    try:
        tree, binary = _read(path)
        return _maps(path, tree, binary)
    except (KeyError, IndexError, ValueError, TypeError, AttributeError, struct.error, OSError) as fault:
        detail = f"{type(fault).__name__}: {fault}".splitlines()[0][:200]
        refuse(path, "sound textures", f"they cannot be read ({detail})", "Export the file again")


def _read(path: Path) -> tuple[dict[str, Any], bytes]:
    data = path.read_bytes()
    if path.suffix.lower() != ".glb":
        return json.loads(data), b""
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def _maps(path: Path, tree: dict[str, Any], binary: bytes) -> dict[str, Any]:
    materials = tree.get("materials") or [{}]
    skin = next((one for one in materials if "skin" in one.get("name", "").lower()), materials[0])

    def picture(reference: dict[str, Any] | None) -> Picture | Path | None:
        if reference is None or reference.get("texCoord", 0) != 0:
            return None
        source = tree["textures"][reference["index"]].get("source")
        return None if source is None else _picture(path, tree, binary, source)

    found: dict[str, Any] = {"colour": picture(skin.get("pbrMetallicRoughness", {}).get("baseColorTexture"))}
    own = skin.get("extras", {}).get("dermis")
    if own is None:
        found["normal"] = picture(skin.get("normalTexture"))
    else:
        found |= {role: picture(own.get(role)) for role in ROLES}
        found["height_mm"] = own.get("height_mm")
    return {role: value for role, value in found.items() if value is not None}


def _picture(path: Path, tree: dict[str, Any], binary: bytes, source: int) -> Picture | Path | None:
    image = tree["images"][source]
    name = f"{path}, image {image.get('name', source)}"
    if "bufferView" in image:
        if image.get("mimeType") not in _READABLE:
            return None
        view = tree["bufferViews"][image["bufferView"]]
        start = view.get("byteOffset", 0)
        return Picture(name, _buffer(path, tree, binary, view["buffer"])[start : start + view["byteLength"]])
    uri = image["uri"]
    if uri.startswith("data:"):
        kind, _, text = uri[5:].partition(";base64,")
        return Picture(name, base64.b64decode(text)) if kind in _READABLE else None
    file = path.parent / unquote(uri)
    return file if file.suffix.lower() in (".png", ".jpg", ".jpeg") else None


def _buffer(path: Path, tree: dict[str, Any], binary: bytes, index: int) -> bytes:
    uri = tree["buffers"][index].get("uri")
    if uri is None:
        return binary
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    return (path.parent / unquote(uri)).read_bytes()
