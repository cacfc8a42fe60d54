"""Grid of the posed skin on the device, by which scalp hair and beards are kept outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.frame.programs import program, workgroup_grid
from dermis.gpu import Buffer, Device, MutableBindings, Recorder
from dermis.mesh.head import Head
from dermis.mesh.skin_grid import SKIN_CELLS, SKIN_WORDS_PER_VERTEX, skin_grid_vertices


@dataclass(frozen=True, eq=False)
class SkinGridBuffers:
    """Buffers of the grid, see skin_grid.wgsl.

    vertices : buffer of the indices of the vertices of the skin
    skin : buffer of the cells, and of the positions and normals of the vertices of the posed skin
    """

    vertices: Buffer
    skin: Buffer


def make_skin_grid(device: Device, head: Head) -> SkinGridBuffers:
    """Upload the vertices of the skin of a head, and allocate the grid."""
    vertices = skin_grid_vertices(head.mesh)
    words = int(np.prod(SKIN_CELLS)) + SKIN_WORDS_PER_VERTEX * len(vertices)
    return SkinGridBuffers(device.buffer(vertices, "STORAGE"), device.storage_buffer(4 * words))


def draw_skin_grid(graph: Recorder, buffers: SkinGridBuffers, geometry: HeadGeometry) -> None:
    """Declare the passes that enter the posed skin into the grid.

    geometry : vertices and triangles of the head
    """
    grid: MutableBindings = {"skin": buffers.skin}
    clear = program(graph.device, "hair/skin_clear.wgsl")
    graph.dispatch("strands", clear, grid, workgroup_grid(int(np.prod(SKIN_CELLS))))
    enter = program(graph.device, "hair/skin_enter.wgsl")
    bindings: MutableBindings = {**geometry.resources, **grid, "skin_vertices": buffers.vertices}
    graph.dispatch("strands", enter, bindings, workgroup_grid(buffers.vertices.size // 4))
