"""glTF beyond its triangles: the pictures embedded in a file, and a head written as one .glb file."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.images.io import Picture
from dermis.mesh.mesh import Mesh

_READABLE = {"image/png", "image/jpeg"}
ROLES = ("height", "specular", "roughness", "region")
_FLOAT, _UNSIGNED = 5126, 5125
_VERTICES, _INDICES = 34962, 34963
_LINEAR_MIPMAPS, _LINEAR, _CLAMP = 9987, 9729, 33071
_WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


def embedded_maps(path: Path) -> dict[str, Any]:
    """Options of `load_maps` for the pictures of a .glb or .gltf file, {} for one without.

    The skin's material gives the base colour. Files that the package wrote give the height, specular,
    roughness and region maps of the material's extras too, all others their normal map.

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


@dataclass
class _Binary:
    """The file's one buffer as it grows, with the views and accessors into it."""

    data: bytearray = field(default_factory=bytearray)
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)

    def view(self, part: bytes, target: int | None = None) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(part)}
        self.views.append(entry if target is None else entry | {"target": target})
        self.data += part
        return len(self.views) - 1

    def array(self, values: NDArray[Any], kind: str, component: int, target: int, **more: Any) -> int:
        place = self.view(values.tobytes(), target)
        entry = {"bufferView": place, "componentType": component, "count": values.size // _WIDTH[kind]}
        self.accessors.append(entry | {"type": kind} | more)
        return len(self.accessors) - 1


def encode_glb(
    mesh: Mesh, pictures: Mapping[str, bytes], material: Mapping[str, Any], roles: Mapping[str, Any]
) -> bytes:
    """The bytes of a .glb file.

    mesh : of one material
    pictures : PNG files by name
    material : a glTF material, in which a texture is named by its picture: {"index": name}
    roles : what goes into the material's extras under "dermis", pictures named likewise

    Positions are in mm under a node that scales them to glTF's metres, so that they read back to the bit.
    """
    binary = _Binary()
    positions = np.ascontiguousarray(mesh.positions, "<f4")
    low, high = positions.min(axis=0).tolist(), positions.max(axis=0).tolist()
    attributes = {
        "POSITION": binary.array(positions, "VEC3", _FLOAT, _VERTICES, min=low, max=high),
        "NORMAL": binary.array(np.ascontiguousarray(mesh.normals, "<f4"), "VEC3", _FLOAT, _VERTICES),
        "TEXCOORD_0": binary.array(np.ascontiguousarray(mesh.uv, "<f4"), "VEC2", _FLOAT, _VERTICES),
    }
    triangles = np.ascontiguousarray(mesh.triangles, "<u4")
    indices = binary.array(triangles, "SCALAR", _UNSIGNED, _INDICES)
    kind = {"mimeType": "image/png"}
    images = [{"bufferView": binary.view(data), **kind, "name": name} for name, data in pictures.items()]
    places = {name: index for index, name in enumerate(pictures)}
    primitive = {"attributes": attributes, "indices": indices, "material": 0}
    tree = {
        "asset": {"version": "2.0", "generator": "dermis"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "head", "scale": [0.001, 0.001, 0.001]}],
        "meshes": [{"name": "head", "primitives": [primitive]}],
        "materials": [_placed(dict(material) | {"extras": {"dermis": dict(roles)}}, places)],
        "textures": [{"source": index, "sampler": 0} for index in range(len(images))],
        "samplers": [{"magFilter": _LINEAR, "minFilter": _LINEAR_MIPMAPS, "wrapS": _CLAMP, "wrapT": _CLAMP}],
        "images": images,
        "bufferViews": binary.views,
        "accessors": binary.accessors,
        "buffers": [{"byteLength": len(binary.data)}],
    }
    used = sorted(material.get("extensions", {}))
    return _glb(tree | ({"extensionsUsed": used} if used else {}), binary.data)


def _placed(value: Any, places: Mapping[str, int]) -> Any:
    """The tree with pictures' names replaced by the indices of their textures."""
    if isinstance(value, Mapping):
        return {
            key: places[one] if key == "index" and one in places else _placed(one, places)
            for key, one in value.items()
        }
    return value


def _glb(tree: Mapping[str, Any], binary: bytes | bytearray) -> bytes:
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    body = bytes(binary) + b"\0" * (-len(binary) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(body))
    chunks = ((b"JSON", text), (b"BIN\0", body))
    return head + b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks)
