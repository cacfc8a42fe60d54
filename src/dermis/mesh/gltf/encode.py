"""A head written as one .glb file."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.mesh import Mesh

_FLOAT, _UNSIGNED = 5126, 5125
_VERTICES, _INDICES = 34962, 34963
_LINEAR_MIPMAPS, _LINEAR, _CLAMP = 9987, 9729, 33071
_WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}


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
    """The tree with pictures' names replaced by their textures' numbers."""
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
