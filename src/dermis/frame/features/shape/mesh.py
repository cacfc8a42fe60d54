"""The mesh as textures and as buffers, with the place of each triangle in the atlas."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.frame.features.shape.shape import VERTICES, Shape, ShapeTables, rest_shape
from dermis.gpu import Buffer, Device, Memo, Texture
from dermis.gpu.textures import texture_from
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh

_TRIANGLES_PER_ROW = 2048  # the shaders take it from the texture's width


@dataclass(frozen=True, eq=False)
class HeadResources:
    """What the shaders read of a head's surface.

    resources : textures and buffers by their names in geometry.wgsl
    indices : buffer of the triangles' vertices, for the rasteriser
    triangles : count
    """

    resources: dict[str, Texture | Buffer]
    indices: Buffer
    triangles: int

    def shaped(self, shape: Shape) -> HeadResources:
        """The same triangles with the vertices of another shape."""
        return replace(self, resources=self.resources | shape.vertices)

    def placed(self, other: HeadResources) -> HeadResources:
        """The same triangles with another's vertices."""
        return replace(
            self, resources={**self.resources, **{name: other.resources[name] for name in VERTICES}}
        )


def upload_geometry(device: Device, mesh: Mesh, atlas: Atlas, shape: Shape) -> HeadResources:
    """A head's triangles in an atlas, and the vertices of its shape."""
    return _uploaded(device, _triangle_table(mesh, atlas), shape.vertices)


def upload_bare(device: Device, triangles: NDArray[np.integer]) -> HeadResources:
    """Triangles of no atlas and no material, without their vertices, for views that take depths alone.

    triangles : (t, 3) vertices
    """
    table = np.zeros((3, len(triangles), 4), dtype=np.uint32)
    table[0, :, :3] = triangles
    return _uploaded(device, table, {})


def _uploaded(
    device: Device, table: NDArray[np.uint32], vertices: dict[str, Texture | Buffer]
) -> HeadResources:
    rows = np.concatenate([_rows(part, _TRIANGLES_PER_ROW) for part in table])
    read = device.adapter.kind != "CPU"  # see geometry.wgsl; what is not read still needs to be there
    resources: dict[str, Texture | Buffer] = {
        "triangle_table": texture_from(device, rows, "rgba32uint"),
        "triangle_buffer": device.buffer(rows if read else rows[:1, :3], "STORAGE"),
    }
    return HeadResources(resources | vertices, device.buffer(table[0, :, :3], "INDEX"), table.shape[1])


def _triangle_table(mesh: Mesh, atlas: Atlas) -> NDArray[np.uint32]:
    opaque = np.array([material.kind == "opaque" for material in mesh.materials])
    table = np.zeros((3, len(mesh.triangles), 4), dtype=np.uint32)
    table[0, :, :3] = mesh.triangles
    table[0, :, 3] = atlas.mapped | (opaque[mesh.material] << 1) | (mesh.material.astype(np.uint32) << 8)
    table[1] = np.ascontiguousarray(atlas.place[:, :2]).reshape(-1, 4).view(np.uint32)
    table[2, :, :2] = np.ascontiguousarray(atlas.place[:, 2]).view(np.uint32)
    table[2, :, 2] = atlas.per_uv.view(np.uint32)
    return table


def _rows(table: NDArray[np.uint32], per_row: int) -> NDArray[np.uint32]:
    rows = -(-len(table) // per_row)
    padded = np.zeros((rows * per_row, table.shape[1]), dtype=table.dtype)
    padded[: len(table)] = table
    return padded.reshape(rows, per_row, -1)


def surface_at_rest(
    memo: Memo,
    device: Device,
    held: HeadResources,
    tables: ShapeTables,
    head: Head,
    person: NDArray[np.float32] | None,
    index: int,
) -> HeadResources:
    """The triangles of an atlas at rest.

    person : (p, 3) places of the head's control points where another person rests, None for the head's own
    index : of the atlas among several
    """
    positions, of = (head.control.positions_mm, "head") if person is None else (person, "person")
    shape = memo.keep(rest_shape, device, tables, positions, of=of)
    return memo.keep(HeadResources.shaped, held, shape, of=f"{of} {index}")
