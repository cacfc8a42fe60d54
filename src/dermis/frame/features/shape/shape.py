"""Shape of a head on the device: control points, their motion, and the surface through these points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.frame.programs import program, workgroup_grid
from dermis.gpu import Bindings, Buffer, CommandList, Constants, Device, Recorder, Texture, make_texture
from dermis.mesh.eyeball import LidContact
from dermis.mesh.geometry import MIN_DOUBLE_UV_AREA, vertex_normals
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.rig import MorphTargets, Rig, Skeleton, Stencils

Doubles = NDArray[np.float64]
Words = NDArray[np.uint32]
VERTICES_PER_ROW = 512
"""Number of vertices per row of the vertex texture; each vertex has four texels."""
VERTEX_RESOURCES = ("vertex_table", "vertex_buffer", "vertex_lengths")
"""Names of the vertex textures and buffers in geometry.wgsl and texel_stretch.wgsl."""
_VERTEX_STRUCT_MEMBERS = ("uv", "f4", 2), ("point", "u4"), ("pad", "u4"), ("normal", "f4", 3), ("last", "u4")
_VERTEX_DTYPE = np.dtype(list(_VERTEX_STRUCT_MEMBERS))  # struct of a vertex in shape_vertices.wgsl
MIN_RELATIVE_TANGENT = 1e-3
"""Least length, relative to dpdu, of the part of dpdu that is orthogonal to the normal.

Where this part is shorter, another direction that is orthogonal to the normal replaces it.
"""


@dataclass(frozen=True, eq=False)
class ShapeTables:
    """Buffers of a head's mesh and rig that are constant over frames, and the numbers of their elements.

    morphs : dictionary from names in shape_pose.wgsl to morph targets and bone weights, empty for heads that
        do not move
    stencils : dictionary from names in shape_refine.wgsl to subdivision weights of control points, empty
        without subdivision
    surface : dictionary from names in shape_vertices.wgsl to vertices and triangles
    control : number of control points
    points : number of points after subdivision
    vertices : number of vertices
    targets : number of morph targets
    bones : number of bones
    has_contacts : whether some points, such as points of the eyelids, are kept outside the eyeballs
    """

    morphs: dict[str, Buffer]
    stencils: dict[str, Buffer]
    surface: dict[str, Buffer]
    control: int
    points: int
    vertices: int
    targets: int
    bones: int
    has_contacts: bool


@dataclass(frozen=True, eq=False)
class Shape:
    """Buffers that the passes of a shape read and write.

    rest : buffer of the control points at rest, written in each frame
    weights : buffer of the morph weights, written in each frame
    matrices : buffer of the bone matrices, written in each frame
    morphs : dictionary from names in shape_pose.wgsl to resources, empty if the pass is not needed
    stencils : dictionary from names in shape_refine.wgsl to resources, empty if the pass is not needed
    surface : dictionary from names in shape_vertices.wgsl to resources
    tables : buffers that are constant over frames
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
        """Return a dictionary from names in shaders to the textures and buffers of the vertices."""
        return {name: self.surface[name] for name in VERTEX_RESOURCES}


def shape_tables(device: Device, head: Head) -> ShapeTables:
    """Upload the mesh and the rig of a head to the buffers from which its shape is computed."""
    rig, mesh = head.control_rig, head.mesh
    moves, bones = bool(rig.targets.names or rig.skeleton), len(rig.skeleton.names) if rig.skeleton else 0
    return ShapeTables(
        morphs=_upload_tables(device, _morph_tables(rig)) if moves else {},
        stencils=_upload_tables(device, _stencil_tables(rig.stencils)) if rig.stencils else {},
        surface=_upload_tables(device, _surface_tables(mesh)),
        control=len(rig.positions_mm),
        points=int(mesh.point.max()) + 1,
        vertices=len(mesh.positions),
        targets=len(rig.targets.names),
        bones=bones,
        has_contacts=rig.contact is not None,
    )


def make_shape(device: Device, shape_tables: ShapeTables, *, is_animated: bool = True) -> Shape:
    """Create the buffers of a shape.

    shape_tables : constant buffers of the head, from `shape_tables`
    is_animated : whether morph targets and bones move the shape; False for a shape at rest
    """
    rest, morphs, stencils = (
        _point_buffer(device, shape_tables.control),
        dict[str, Buffer](),
        dict[str, Buffer](),
    )
    weights, matrices = (
        _float_buffer(device, max(1, shape_tables.targets)),
        _float_buffer(device, 12 * max(1, shape_tables.bones)),
    )
    points = rest
    if is_animated and shape_tables.morphs:
        points = _point_buffer(device, shape_tables.control)
        moving = {"rest": rest, "weights": weights, "matrices": matrices, "posed": points}
        morphs = shape_tables.morphs | moving
    if shape_tables.stencils:
        finer = _point_buffer(device, shape_tables.points)
        stencils, points = shape_tables.stencils | {"control": points, "points": finer}, finer
    surface = shape_tables.surface | {"points": points} | _vertex_resources(device, shape_tables.vertices)
    return Shape(rest, weights, matrices, morphs, stencils, surface, shape_tables)


def _point_buffer(device: Device, point_count: int) -> Buffer:
    return _float_buffer(device, 3 * point_count)


def _float_buffer(device: Device, float_count: int) -> Buffer:
    return device.buffer(np.zeros(float_count, np.float32), "STORAGE")


def _upload_tables(device: Device, named_tables: dict[str, NDArray[np.generic]]) -> dict[str, Buffer]:
    return {name: device.buffer(table, "STORAGE") for name, table in named_tables.items()}


def _vertex_resources(device: Device, vertex_count: int) -> dict[str, Texture | Buffer]:
    """Create the texture and the buffer of vertices, and the buffer of tangent lengths.

    Software adapters store vertices in the texture, GPUs store them in the buffer. The resource that is not
    used has the smallest possible size.
    """
    rows, software = -(-vertex_count // VERTICES_PER_ROW), device.adapter.kind == "CPU"
    table = make_texture(device, (4 * VERTICES_PER_ROW, rows if software else 1), "rgba32float")
    words = np.zeros((1 if software else rows * VERTICES_PER_ROW, 4, 4), np.float32)
    return dict(
        zip(
            VERTEX_RESOURCES,
            (table, device.buffer(words, "STORAGE"), _float_buffer(device, 4 * vertex_count)),
            strict=True,
        )
    )


def _morph_tables(rig: Rig) -> dict[str, NDArray[np.generic]]:
    """Return the tables that shape_pose.wgsl reads, by name.

    They hold, for each control point, its displacements by morph targets, its bone weights and, for points of
    the eyelids, the eyeball over which they slide.
    """
    count = len(rig.positions_mm)
    return {
        "first": _run_offsets(rig.targets.point, count),
        "displacements": displacement_rows(rig.targets, rig.targets),
        "influences": _bone_influences(rig.skeleton, count),
        "contacts": _contact_words(rig.contact, count),
    }


def displacement_rows(targets: MorphTargets, template_targets: MorphTargets) -> NDArray[np.float32]:
    """Return (n, 4) rows of displacement [mm] and morph target index, ordered by point, for shape_pose.wgsl.

    targets : morph targets of a person
    template_targets : morph targets of the person's template, which displace the same points in the same
        order
    """
    target_index = np.repeat(np.arange(len(targets.names), dtype=np.uint32), np.diff(targets.first))
    order = template_targets.point_order
    table = np.zeros((max(1, len(order)), 4), np.float32)
    table[: len(order), :3] = targets.delta_mm.take(order, axis=0)
    table[: len(order), 3] = target_index.take(order).view(np.float32)
    return table


def _bone_influences(skeleton: Skeleton | None, point_count: int) -> Words:
    """Return (p, 8) words: for each point, four bone indices, and the bone weights as float bits.

    point_count : number of points
    """
    if skeleton is None:
        return np.zeros((1, 8), np.uint32)
    weight = np.ascontiguousarray(skeleton.weight, np.float32).view(np.uint32)
    return np.ascontiguousarray(np.concatenate([skeleton.bone.astype(np.uint32), weight], axis=1))


def _contact_words(lid_contact: LidContact | None, point_count: int) -> Words:
    """Return (p, 3) words by which shape_pose.wgsl keeps points of the eyelids outside the eyeballs.

    The words of an eyelid point are the indices of the frontmost and the rearmost point of its eyeball, and
    the bits of a float: the least distance that it keeps from the eyeball, for an eye of adult size [mm]. The
    words of all other points are 0.

    lid_contact : eyelid points and the eyeballs over which they slide; None gives one row of zeros
    point_count : number of points
    """
    if lid_contact is None:
        return np.zeros((1, 3), np.uint32)
    words = np.zeros((point_count, 3), np.uint32)
    clearance = np.ascontiguousarray(lid_contact.min_clearance_mm, np.float32).view(np.uint32)
    ends = lid_contact.apex[lid_contact.ball], lid_contact.back[lid_contact.ball]
    words[lid_contact.point] = np.stack([*ends, clearance], axis=1)
    return words


def _stencil_tables(stencils: Stencils) -> dict[str, NDArray[np.generic]]:
    weight = stencils.weight.astype(np.float32).view(np.uint32)
    terms = np.stack([stencils.point.astype(np.uint32), weight], axis=1)
    return {"first": stencils.first.astype(np.uint32), "terms": terms}


def _surface_tables(mesh: Mesh) -> dict[str, NDArray[np.generic]]:
    """Return the tables that shape_vertices.wgsl reads, by name: vertices, triangle corners and spans.

    Vertices with different uv can share a point. Triangle corners are ordered by point and then by vertex, so
    that the corners at a point, and also the corners of a vertex, are contiguous. For each vertex, the spans
    store these two ranges of corners.
    """
    count, corner = len(mesh.positions), mesh.triangles.ravel().astype(np.int64)
    table = np.zeros(count, _VERTEX_DTYPE)
    table["uv"], table["point"] = mesh.uv, mesh.point
    table["normal"] = normals_in_vertex_frames(mesh)
    # by point, then by vertex: the corners of a vertex are a range within those of its point
    point, key = mesh.point[corner], mesh.point[corner] * np.int64(count) + corner
    order = np.argsort(key, kind="stable")
    vertex = mesh.point * np.int64(count) + np.arange(count)
    spans = run_bounds(point[order], mesh.point), run_bounds(key[order], vertex)
    other_corners = np.stack([np.roll(mesh.triangles, -k, axis=1).ravel()[order] for k in (1, 2)], axis=1)
    return {
        "vertices": table.view(np.uint32),
        "spans": np.concatenate(spans, axis=1),
        "corners": other_corners.astype(np.uint32),
    }


def run_bounds(sorted_values: NDArray[np.integer], searched_values: NDArray[np.integer]) -> Words:
    """Return the (n, 2) start and end of the range in a sorted array that holds each searched value.

    sorted_values : sorted array
    searched_values : (n,) values; for a value that is not in the array, start and end are equal
    """
    ends = [np.searchsorted(sorted_values, searched_values, side) for side in ("left", "right")]
    return np.stack(ends, axis=1).astype(np.uint32)


def normals_in_vertex_frames(mesh: Mesh) -> Doubles:
    """Return the (v, 3) normals of a mesh, each in a frame that moves with its vertex.

    The axes of the frame are the smooth normal, the u direction made orthogonal to the normal, and the cross
    product of these two axes. In this frame, the normal of a vertex is constant while the surface deforms.
    """
    smooth = vertex_normals(mesh.positions, mesh.point, mesh.triangles).astype(np.float64)
    axis = np.eye(3)[np.abs(smooth).argmin(axis=1)]
    tangent = mesh.dpdu - (mesh.dpdu * smooth).sum(axis=1, keepdims=True) * smooth
    length = np.linalg.norm(tangent, axis=1, keepdims=True)
    usable = length > MIN_RELATIVE_TANGENT * np.linalg.norm(mesh.dpdu, axis=1, keepdims=True)
    tangent = np.where(usable, tangent, np.cross(axis, smooth))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frame = np.stack([smooth, tangent, np.cross(smooth, tangent)], axis=1)
    return np.asarray(np.einsum("vkc,vc->vk", frame, mesh.normals.astype(np.float64)))


def _run_offsets(sorted_index: NDArray[np.integer], run_count: int) -> Words:
    """Return the offset in a sorted array where each integer from 0 to run_count - 1 first occurs.

    The result has the shape (run_count + 1,); its last element is the length of the array. An integer that
    does not occur gets the offset of the next larger integer.

    sorted_index : sorted integers from 0 to run_count - 1
    run_count : number of different integers that can occur
    """
    return np.concatenate([[0], np.cumsum(np.bincount(sorted_index, minlength=run_count))]).astype(np.uint32)


class PoseBytes(NamedTuple):
    """Pose of a shape as bytes for the shaders.

    positions : position of each control point at rest, three floats [mm]
    weights : weight of each morph target, one float
    matrices : matrix of each bone, from rest to pose, twelve floats row by row [mm]
    displacements : result of `displacement_rows` if the person's morph targets replace the targets of the
        template, else empty
    """

    positions: bytes
    weights: bytes = b""
    matrices: bytes = b""
    displacements: bytes = b""

    @property
    def at_rest(self) -> PoseBytes:
        """Return the pose at rest: only the control points, with neither morph weights nor bone matrices."""
        return PoseBytes(self.positions)


def draw(graph: Recorder, shape: Shape, pose_bytes: PoseBytes) -> None:
    """Write the pose to buffers, and declare the passes that compute the vertices of the posed surface."""
    graph.write("shape", shape.rest, pose_bytes.positions)
    if pose_bytes.weights:
        graph.write("shape", shape.weights, pose_bytes.weights)
    if pose_bytes.matrices:
        graph.write("shape", shape.matrices, pose_bytes.matrices)
    if pose_bytes.displacements:
        graph.write("shape", shape.morphs["displacements"], pose_bytes.displacements)
    graph.add_replayable(_evaluate_surface, shape)


def make_rest_shape(device: Device, shape_tables: ShapeTables) -> Shape:
    """Create the buffers of a person's shape at rest, with neither morph targets nor bones."""
    return make_shape(device, shape_tables, is_animated=False)


def evaluate_rest_shape(
    device: Device, shape_tables: ShapeTables, positions_mm: NDArray[np.float32]
) -> Shape:
    """Create the shape of a person at rest, and compute its vertices immediately.

    positions_mm : (p, 3) control points [mm]
    """
    shape, frame = make_rest_shape(device, shape_tables), CommandList(device, timed=False)
    draw(frame, shape, PoseBytes(positions_mm.tobytes()))
    frame.submit()
    return shape


def rest_pose_bytes(rig: Rig) -> PoseBytes:
    """Return the rest pose of a rig as bytes for the shaders."""
    weights, matrices, positions = (array.tobytes() for array in rig.rest)
    if rig.template is None or not rig.targets.names:
        return PoseBytes(positions, weights, matrices)
    own = displacement_rows(rig.targets, rig.template.targets)
    return PoseBytes(positions, weights, matrices, own.tobytes())


def _evaluate_surface(graph: Recorder, shape: Shape) -> None:
    tables = shape.tables
    if shape.morphs:
        constants = ("HAS_BONES", tables.bones > 0), ("HAS_CONTACTS", tables.has_contacts)
        _dispatch_shape(graph, "shape/shape_pose.wgsl", shape.morphs, tables.control, constants)
    if shape.stencils:
        _dispatch_shape(graph, "shape/shape_refine.wgsl", shape.stencils, tables.points)
    limits = (("MIN_DOUBLE_UV_AREA", MIN_DOUBLE_UV_AREA), ("MIN_TANGENT", MIN_RELATIVE_TANGENT))
    _dispatch_shape(graph, "shape/shape_vertices.wgsl", shape.surface, tables.vertices, limits)


def _dispatch_shape(
    graph: Recorder,
    shader_name: str,
    bindings: Bindings,
    invocation_count: int,
    constants: Constants = (),
) -> None:
    """Declare a pass that computes one step from the control points at rest to the posed surface.

    shader_name : path of the shader
    bindings : resources of the shader
    invocation_count : number of shader invocations, one for each point or vertex
    """
    graph.dispatch(
        "shape",
        program(graph.device, shader_name, constants),
        bindings,
        workgroup_grid(invocation_count),
    )
