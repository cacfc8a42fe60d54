"""The shape of a head on the device: its control points, what moves them, and the surface they span."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.frame.programs import each, program
from dermis.gpu import (
    Bindings,
    Buffer,
    CommandList,
    Constants,
    Device,
    Recorder,
    Texture,
    make_texture,
)
from dermis.mesh.eyeball import Contact
from dermis.mesh.geometry import MIN_UV_CROSS, vertex_normals
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.rig import MorphTargets, Rig, Skeleton, Stencils

Doubles = NDArray[np.float64]
Words = NDArray[np.uint32]
VERTICES_PER_ROW = 512
"""Of the texture of vertices, four texels each."""
VERTICES = ("vertex_table", "vertex_buffer", "vertex_lengths")
"""Names of the vertices in geometry.wgsl and stretch_of.wgsl."""
_PARTS = ("uv", "f4", 2), ("point", "u4"), ("pad", "u4"), ("normal", "f4", 3), ("last", "u4")
_VERTEX = np.dtype(list(_PARTS))  # as shape_vertices.wgsl reads it
LEAST_ACROSS = 1e-3
"""Share of dpdu across the normal, below which any other direction serves as well."""


@dataclass(frozen=True, eq=False)
class ShapeTables:
    """What a shape is made by: buffers by their names in the shaders, that no motion changes.

    morphs : what moves the control points, as shape_pose.wgsl reads it; empty for nothing
    stencils : means of control points, as shape_refine.wgsl reads them; empty for no subdivision
    surface : the mesh, as shape_vertices.wgsl reads it
    control, points, vertices : counts
    targets, bones : counts
    slides : whether some points stay off eyeballs
    """

    morphs: dict[str, Buffer]
    stencils: dict[str, Buffer]
    surface: dict[str, Buffer]
    control: int
    points: int
    vertices: int
    targets: int
    bones: int
    slides: bool


@dataclass(frozen=True, eq=False)
class Shape:
    """What the passes of the shape read and write, by the names in their shaders.

    rest, weights, matrices : buffers that each frame's motion is written to, beside `morphs`' displacements
    morphs, stencils, surface : of shape_pose.wgsl, shape_refine.wgsl, shape_vertices.wgsl; empty for no pass
    tables : those that it is made by
    """

    rest: Buffer
    weights: Buffer
    matrices: Buffer
    morphs: dict[str, Buffer]
    stencils: dict[str, Buffer]
    surface: dict[str, Texture | Buffer]
    tables: ShapeTables

    @property
    def vertices(self) -> dict[str, Texture | Buffer]:
        """The vertices by their names in the shaders that read them."""
        return {name: self.surface[name] for name in VERTICES}


def shape_tables(device: Device, head: Head) -> ShapeTables:
    """What the shapes of a head are made by."""
    rig, mesh = head.control, head.mesh
    moves, bones = bool(rig.targets.names or rig.skeleton), len(rig.skeleton.names) if rig.skeleton else 0
    return ShapeTables(
        morphs=_buffers(device, _morph_tables(rig)) if moves else {},
        stencils=_buffers(device, _stencil_tables(rig.stencils)) if rig.stencils else {},
        surface=_buffers(device, _surface_tables(mesh)),
        control=len(rig.positions_mm),
        points=int(mesh.point.max()) + 1,
        vertices=len(mesh.positions),
        targets=len(rig.targets.names),
        bones=bones,
        slides=rig.contact is not None,
    )


def make_shape(device: Device, tables: ShapeTables, *, moves: bool = True) -> Shape:
    """Space for a shape.

    moves : False for one that no morph target and no bone moves
    """
    rest, morphs, stencils = _points(device, tables.control), dict[str, Buffer](), dict[str, Buffer]()
    weights, matrices = _floats(device, max(1, tables.targets)), _floats(device, 12 * max(1, tables.bones))
    points = rest
    if moves and tables.morphs:
        points = _points(device, tables.control)
        moving = {"rest": rest, "weights": weights, "matrices": matrices, "posed": points}
        morphs = tables.morphs | moving
    if tables.stencils:
        finer = _points(device, tables.points)
        stencils, points = tables.stencils | {"control": points, "points": finer}, finer
    surface = tables.surface | {"points": points} | _vertices(device, tables.vertices)
    return Shape(rest, weights, matrices, morphs, stencils, surface, tables)


def _points(device: Device, count: int) -> Buffer:
    return _floats(device, 3 * count)


def _floats(device: Device, count: int) -> Buffer:
    return device.buffer(np.zeros(count, np.float32), "STORAGE")


def _buffers(device: Device, tables: dict[str, NDArray[np.generic]]) -> dict[str, Buffer]:
    return {name: device.buffer(table, "STORAGE") for name, table in tables.items()}


def _vertices(device: Device, count: int) -> dict[str, Texture | Buffer]:
    """Space for vertices; GPUs read the buffer and software the texture, the other is there to be bound."""
    rows, software = -(-count // VERTICES_PER_ROW), device.adapter.kind == "CPU"
    table = make_texture(device, (4 * VERTICES_PER_ROW, rows if software else 1), "rgba32float")
    words = np.zeros((1 if software else rows * VERTICES_PER_ROW, 4, 4), np.float32)
    return dict(
        zip(VERTICES, (table, device.buffer(words, "STORAGE"), _floats(device, 4 * count)), strict=True)
    )


def _morph_tables(rig: Rig) -> dict[str, NDArray[np.generic]]:
    """Displacements and influences point by point."""
    count = len(rig.positions_mm)
    return {
        "first": _starts(rig.targets.point, count),
        "displacements": displacements(rig.targets, rig.targets),
        "influences": _influences(rig.skeleton, count),
        "contacts": _contacts(rig.contact, count),
    }


def displacements(targets: MorphTargets, template: MorphTargets) -> NDArray[np.float32]:
    """(n, 4) displacements point by point, each with its target's number, as shape_pose.wgsl reads them.

    template : targets that move the same points
    """
    number = np.repeat(np.arange(len(targets.names), dtype=np.uint32), np.diff(targets.first))
    order = template.by_point
    table = np.zeros((max(1, len(order)), 4), np.float32)
    table[: len(order), :3] = targets.delta_mm.take(order, axis=0)
    table[: len(order), 3] = number.take(order).view(np.float32)
    return table


def _influences(skeleton: Skeleton | None, count: int) -> Words:
    """(p, 8) four bones and their weights."""
    if skeleton is None:
        return np.zeros((1, 8), np.uint32)
    weight = np.ascontiguousarray(skeleton.weight, np.float32).view(np.uint32)
    return np.ascontiguousarray(np.concatenate([skeleton.bone.astype(np.uint32), weight], axis=1))


def _contacts(contact: Contact | None, count: int) -> Words:
    """(p, 3) two points of the eyeball that each point stays off, and the least distance."""
    if contact is None:
        return np.zeros((1, 3), np.uint32)
    found = np.zeros((count, 3), np.uint32)
    clear = np.ascontiguousarray(contact.clear_mm, np.float32).view(np.uint32)
    found[contact.point] = np.stack([contact.apex[contact.ball], contact.back[contact.ball], clear], axis=1)
    return found


def _stencil_tables(stencils: Stencils) -> dict[str, NDArray[np.generic]]:
    weight = stencils.weight.astype(np.float32).view(np.uint32)
    terms = np.stack([stencils.point.astype(np.uint32), weight], axis=1)
    return {"first": stencils.first.astype(np.uint32), "terms": terms}


def _surface_tables(mesh: Mesh) -> dict[str, NDArray[np.generic]]:
    """The vertices, the corners of triangles around them, and which of these are each one's own."""
    count, corner = len(mesh.positions), mesh.triangles.ravel().astype(np.int64)
    table = np.zeros(count, _VERTEX)
    table["uv"], table["point"] = mesh.uv, mesh.point
    table["normal"] = own_normals(mesh)
    # by point, then by vertex: those of a vertex lie within those of its point
    point, key = mesh.point[corner], mesh.point[corner] * np.int64(count) + corner
    order = np.argsort(key, kind="stable")
    vertex = mesh.point * np.int64(count) + np.arange(count)
    spans = spans_of(point[order], mesh.point), spans_of(key[order], vertex)
    others = np.stack([np.roll(mesh.triangles, -k, axis=1).ravel()[order] for k in (1, 2)], axis=1)
    return {
        "vertices": table.view(np.uint32),
        "spans": np.concatenate(spans, axis=1),
        "corners": others.astype(np.uint32),
    }


def spans_of(ordered: NDArray[np.integer], wanted: NDArray[np.integer]) -> Words:
    """(n, 2) where the runs of some numbers begin and end among sorted ones."""
    ends = [np.searchsorted(ordered, wanted, side) for side in ("left", "right")]
    return np.stack(ends, axis=1).astype(np.uint32)


def own_normals(mesh: Mesh) -> Doubles:
    """(v, 3) the mesh's normals as seen from its smooth ones: along these, and along and beside u.

    A file's normals keep this place while the surface moves.
    """
    smooth = vertex_normals(mesh.positions, mesh.point, mesh.triangles).astype(np.float64)
    axis = np.eye(3)[np.abs(smooth).argmin(axis=1)]
    forth = mesh.dpdu - (mesh.dpdu * smooth).sum(axis=1, keepdims=True) * smooth
    length = np.linalg.norm(forth, axis=1, keepdims=True)
    usable = length > LEAST_ACROSS * np.linalg.norm(mesh.dpdu, axis=1, keepdims=True)
    forth = np.where(usable, forth, np.cross(axis, smooth))
    forth /= np.linalg.norm(forth, axis=1, keepdims=True)
    frame = np.stack([smooth, forth, np.cross(smooth, forth)], axis=1)
    return np.asarray(np.einsum("vkc,vc->vk", frame, mesh.normals.astype(np.float64)))


def _starts(index: NDArray[np.integer], count: int) -> Words:
    """(count + 1,) where the runs of 0, 1, 2, ... begin among sorted numbers."""
    return np.concatenate([[0], np.cumsum(np.bincount(index, minlength=count))]).astype(np.uint32)


class MotionBytes(NamedTuple):
    """What moves a shape, as the shaders read it.

    positions : three floats for each control point at rest [mm]
    weights : a float for each morph target
    matrices : twelve floats for each bone, row by row, from rest to pose [mm]
    displacements : by morph targets, from `frame.shape.displacements`, of a person whose tables are shared
    """

    positions: bytes
    weights: bytes = b""
    matrices: bytes = b""
    displacements: bytes = b""

    @property
    def at_rest(self) -> MotionBytes:
        """That of a shape which nothing moves."""
        return MotionBytes(self.positions)


def draw(graph: Recorder, shape: Shape, motion: MotionBytes) -> None:
    """Put the shape where the motion has it."""
    graph.write("shape", shape.rest, motion.positions)
    if motion.weights:
        graph.write("shape", shape.weights, motion.weights)
    if motion.matrices:
        graph.write("shape", shape.matrices, motion.matrices)
    if motion.displacements:
        graph.write("shape", shape.morphs["displacements"], motion.displacements)
    graph.repeat(_evaluate, shape)


def still_shape(device: Device, tables: ShapeTables) -> Shape:
    """Space for the shape of a person at rest."""
    return make_shape(device, tables, moves=False)


def rest_shape(device: Device, tables: ShapeTables, positions_mm: NDArray[np.float32]) -> Shape:
    """The shape of a person at rest, evaluated at once.

    positions_mm : (p, 3) of the control points
    """
    made, frame = still_shape(device, tables), CommandList(device, timed=False)
    draw(frame, made, MotionBytes(positions_mm.tobytes()))
    frame.submit()
    return made


def motion_at_rest(rig: Rig) -> MotionBytes:
    """The motion that leaves a rig where it is."""
    weights, matrices, positions = (array.tobytes() for array in rig.rest)
    if rig.template is None or not rig.targets.names:
        return MotionBytes(positions, weights, matrices)
    own = displacements(rig.targets, rig.template.targets)
    return MotionBytes(positions, weights, matrices, own.tobytes())


def _evaluate(graph: Recorder, shape: Shape) -> None:
    tables = shape.tables
    if shape.morphs:
        moving = ("BONED", tables.bones > 0), ("SLIDES", tables.slides)
        _each(graph, "shape/shape_pose.wgsl", shape.morphs, tables.control, moving)
    if shape.stencils:
        _each(graph, "shape/shape_refine.wgsl", shape.stencils, tables.points)
    least = (("LEAST_UV", MIN_UV_CROSS), ("LEAST_ACROSS", LEAST_ACROSS))
    _each(graph, "shape/shape_vertices.wgsl", shape.surface, tables.vertices, least)


def _each(graph: Recorder, name: str, bound: Bindings, count: int, constants: Constants = ()) -> None:
    """A pass of one invocation for each of `count`."""
    graph.dispatch("shape", program(graph.device, name, constants), bound, each(count))
