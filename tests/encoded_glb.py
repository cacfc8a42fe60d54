"""A head written as one .glb file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dermis.formats.gltf.binary import (
    CLAMPED_SAMPLER,
    VERTEX_TARGET,
    BufferBuilder,
    glb_bytes,
    resolve_textures,
)
from dermis.mesh.mesh import Mesh


def encode_glb(
    mesh: Mesh, pictures: Mapping[str, bytes], material: Mapping[str, Any], roles: Mapping[str, Any]
) -> bytes:
    """Return the bytes of a .glb file.

    mesh : mesh of one material
    pictures : PNG files by name
    material : glTF material, in which a texture is named by its picture: {"index": name}
    roles : extras of the material under "dermis", with pictures named likewise

    Positions are in mm under a node that scales them to metres, so that they are read back bit for bit.
    """
    binary = BufferBuilder()
    attributes = {
        "POSITION": binary.add_accessor(mesh.positions, VERTEX_TARGET, with_bounds=True),
        "NORMAL": binary.add_accessor(mesh.normals, VERTEX_TARGET),
        "TEXCOORD_0": binary.add_accessor(mesh.uv, VERTEX_TARGET),
    }
    indices = binary.add_triangles(mesh.triangles, len(mesh.positions))
    kind = {"mimeType": "image/png"}
    images = [{"bufferView": binary.add_view(data), **kind, "name": name} for name, data in pictures.items()]
    places = {name: index for index, name in enumerate(pictures)}
    primitive = {"attributes": attributes, "indices": indices, "material": 0}
    tree = {
        "asset": {"version": "2.0", "generator": "dermis"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "head", "scale": [0.001, 0.001, 0.001]}],
        "meshes": [{"name": "head", "primitives": [primitive]}],
        "materials": [resolve_textures(dict(material) | {"extras": {"dermis": dict(roles)}}, places)],
        "textures": [{"source": index, "sampler": 0} for index in range(len(images))],
        "samplers": [CLAMPED_SAMPLER],
        "images": images,
        "bufferViews": binary.views,
        "accessors": binary.accessors,
        "buffers": [{"byteLength": len(binary.data)}],
    }
    used = sorted(material.get("extensions", {}))
    return glb_bytes(tree | ({"extensionsUsed": used} if used else {}), binary.data)
