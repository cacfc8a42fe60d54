"""A head written as one .glb file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dermis.formats.gltf.binary import CLAMPED, VERTICES, Binary, glb_bytes, placed
from dermis.mesh.mesh import Mesh


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
    binary = Binary()
    attributes = {
        "POSITION": binary.array(mesh.positions, VERTICES, bounded=True),
        "NORMAL": binary.array(mesh.normals, VERTICES),
        "TEXCOORD_0": binary.array(mesh.uv, VERTICES),
    }
    indices = binary.triangles(mesh.triangles, len(mesh.positions))
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
        "materials": [placed(dict(material) | {"extras": {"dermis": dict(roles)}}, places)],
        "textures": [{"source": index, "sampler": 0} for index in range(len(images))],
        "samplers": [CLAMPED],
        "images": images,
        "bufferViews": binary.views,
        "accessors": binary.accessors,
        "buffers": [{"byteLength": len(binary.data)}],
    }
    used = sorted(material.get("extensions", {}))
    return glb_bytes(tree | ({"extensionsUsed": used} if used else {}), binary.data)
