"""Mesh on the device: vertices, triangles and the atlas coordinates of their corners."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.frame.features.shape.shape import VERTEX_RESOURCES, Shape, ShapeTables, evaluate_rest_shape
from dermis.gpu import Buffer, Constants, Device, Memo, Texture
from dermis.gpu.textures import texture_from_array
from dermis.mesh.head import Head
from dermis.mesh.maps import PartMaps
from dermis.mesh.mesh import Mesh

_CUT_OUT_FLAG = 4  # flag of triangles that are cut out, see cutouts.wgsl
_TRIANGLES_PER_ROW = 2048  # width of the texture; shaders query it


@dataclass(frozen=True, eq=False)
class HeadGeometry:
    """Triangles and vertices of a head on the device.

    resources : dictionary from names in geometry.wgsl to textures and buffers
    indices : index buffer for the rasteriser
    triangles : number of triangles
    has_cutouts : whether the opacity maps of some parts cut holes into these parts, see cutouts.wgsl
    """

    resources: dict[str, Texture | Buffer]
    indices: Buffer
    triangles: int
    has_cutouts: bool = False

    @property
    def cutout_constants(self) -> Constants:
        """Return the pipeline constants that make passes leave out the holes in parts of the head.

        The result is empty if no part has holes.
        """
        return (("CUTOUTS", 1),) if self.has_cutouts else ()

    def with_shape(self, shape: Shape) -> HeadGeometry:
        """Return a copy of this geometry with the posed vertices of a shape."""
        return replace(self, resources=self.resources | shape.vertices)

    def with_vertices_of(self, other_geometry: HeadGeometry) -> HeadGeometry:
        """Return a copy of this geometry with the vertex buffers of another geometry of the same head."""
        return replace(
            self,
            resources={
                **self.resources,
                **{name: other_geometry.resources[name] for name in VERTEX_RESOURCES},
            },
        )


def upload_geometry(
    device: Device, mesh: Mesh, atlas: Atlas, shape: Shape, part_maps: PartMaps | None = None
) -> HeadGeometry:
    """Upload the triangles of a head with their atlas coordinates, to be drawn with the vertices of a shape.

    part_maps : maps of the parts that are not skin, among them an opacity map that cuts holes into parts;
        None to leave out all triangles that can have holes
    """
    table, cut_out = _triangle_table(mesh, atlas), mesh.cut_out_mask
    if part_maps is None or not cut_out.any():
        table[0, cut_out, :3] = 0
        return _upload_triangle_table(device, table, shape.vertices)
    table[0, cut_out, 3] |= _CUT_OUT_FLAG
    opacity = texture_from_array(device, part_maps.colour[..., 3:].astype(np.float16), "r16float")
    return replace(
        _upload_triangle_table(device, table, shape.vertices | {"opacity_map": opacity}), has_cutouts=True
    )


def upload_triangles(device: Device, triangle_vertices: NDArray[np.integer]) -> HeadGeometry:
    """Upload only the (t, 3) vertex indices of triangles, for drawing the depths of a simplified mesh."""
    table = np.zeros((3, len(triangle_vertices), 4), dtype=np.uint32)
    table[0, :, :3] = triangle_vertices
    return _upload_triangle_table(device, table, {})


def _upload_triangle_table(
    device: Device, triangle_table: NDArray[np.uint32], vertex_resources: dict[str, Texture | Buffer]
) -> HeadGeometry:
    rows = np.concatenate([_arrange_in_rows(part, _TRIANGLES_PER_ROW) for part in triangle_table])
    read = device.adapter.kind != "CPU"  # see geometry.wgsl; an unread buffer must still be bound
    resources: dict[str, Texture | Buffer] = {
        "triangle_table": texture_from_array(device, rows, "rgba32uint"),
        "triangle_buffer": device.buffer(rows if read else rows[:1, :3], "STORAGE"),
    }
    return HeadGeometry(
        resources | vertex_resources,
        device.buffer(triangle_table[0, :, :3], "INDEX"),
        triangle_table.shape[1],
    )


def _triangle_table(mesh: Mesh, atlas: Atlas) -> NDArray[np.uint32]:
    opaque = np.array([material.kind == "opaque" for material in mesh.materials])
    table = np.zeros((3, len(mesh.triangles), 4), dtype=np.uint32)
    table[0, :, :3] = mesh.triangles
    table[0, :, 3] = atlas.mapped | (opaque[mesh.material] << 1) | (mesh.material.astype(np.uint32) << 8)
    table[1] = np.ascontiguousarray(atlas.corner_uv[:, :2]).reshape(-1, 4).view(np.uint32)
    table[2, :, :2] = np.ascontiguousarray(atlas.corner_uv[:, 2]).view(np.uint32)
    table[2, :, 2] = atlas.texels_per_uv.view(np.uint32)
    return table


def _arrange_in_rows(triangle_table: NDArray[np.uint32], triangles_per_row: int) -> NDArray[np.uint32]:
    rows = -(-len(triangle_table) // triangles_per_row)
    padded = np.zeros((rows * triangles_per_row, triangle_table.shape[1]), dtype=triangle_table.dtype)
    padded[: len(triangle_table)] = triangle_table
    return padded.reshape(rows, triangles_per_row, -1)


def rest_geometry(
    memo: Memo,
    device: Device,
    geometry: HeadGeometry,
    shape_tables: ShapeTables,
    head: Head,
    rest_positions_mm: NDArray[np.float32] | None,
    layout_index: int,
) -> HeadGeometry:
    """Return the triangles of an atlas layout with the vertices of the head at rest.

    geometry : triangles of the layout, with the vertices of the posed head
    rest_positions_mm : (p, 3) control points at rest of a person who shares the mesh of `head` [mm]; None for
        the control points of `head`
    layout_index : index of the atlas layout
    """
    positions, owner = rest_positions_mm, "person"
    if positions is None:
        positions, owner = head.control_rig.positions_mm, "head"
    shape = memo.get(evaluate_rest_shape, device, shape_tables, positions, caller_name=owner)
    return memo.get(HeadGeometry.with_shape, geometry, shape, caller_name=f"{owner} {layout_index}")
