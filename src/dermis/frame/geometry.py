"""The mesh as textures and as buffers, with the place of each triangle in the atlas."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.gpu import Device
from dermis.gpu.textures import texture_from
from dermis.mesh.curvature import vertex_curvature
from dermis.mesh.mesh import Mesh

_TRIANGLES_PER_ROW = 2048  # the shaders take it from the texture's width
_VERTICES_PER_ROW = 512


@dataclass(frozen=True, eq=False)
class HeadResources:
    """Resources of a head, by their names in the shaders.

    resources : name in geometry.wgsl and skin.wgsl -> texture or sampler
    triangles : count
    """

    resources: dict[str, Any]
    triangles: int


def upload_geometry(device: Device, mesh: Mesh, atlas: Atlas) -> dict[str, Any]:
    """Textures and buffers by their names in geometry.wgsl."""
    triangles, vertices = _triangle_table(mesh, atlas), _vertex_table(mesh)
    read = device.adapter.kind != "CPU"  # see geometry.wgsl; what is not read must still be bound
    return {
        "triangle_table": texture_from(device, triangles, "rgba32uint"),
        "vertex_table": texture_from(device, vertices, "rgba32float"),
        "triangle_buffer": device.buffer(triangles if read else triangles[:1, :3], "STORAGE"),
        "vertex_buffer": device.buffer(vertices if read else vertices[:1, :4], "STORAGE"),
    }


def _triangle_table(mesh: Mesh, atlas: Atlas) -> NDArray[np.uint32]:
    opaque = np.array([material.kind == "opaque" for material in mesh.materials])
    table = np.zeros((3, len(mesh.triangles), 4), dtype=np.uint32)
    table[0, :, :3] = mesh.triangles
    table[0, :, 3] = atlas.mapped | (opaque[mesh.material] << 1) | (mesh.material.astype(np.uint32) << 8)
    table[1] = np.ascontiguousarray(atlas.place[:, :2]).reshape(-1, 4).view(np.uint32)
    table[2, :, :2] = np.ascontiguousarray(atlas.place[:, 2]).view(np.uint32)
    return np.concatenate([_rows(part, _TRIANGLES_PER_ROW) for part in table])


def _vertex_table(mesh: Mesh) -> NDArray[np.float32]:
    table = np.zeros((len(mesh.positions), 4, 4), dtype=np.float32)
    for k, attribute in enumerate((mesh.positions, mesh.normals, mesh.dpdu, mesh.dpdv)):
        table[:, k, :3] = attribute
    table[:, :2, 3] = mesh.uv
    table[:, 2, 3] = vertex_curvature(mesh)
    return _rows(table.reshape(len(table), 16), _VERTICES_PER_ROW).reshape(-1, 4 * _VERTICES_PER_ROW, 4)


def _rows(table: NDArray[Any], per_row: int) -> NDArray[Any]:
    rows = -(-len(table) // per_row)
    padded = np.zeros((rows * per_row, table.shape[1]), dtype=table.dtype)
    padded[: len(table)] = table
    return padded.reshape(rows, per_row, -1)
