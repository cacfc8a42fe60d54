"""Primitives of exported glTF heads: vertices, triangles and morph targets of each material."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Intp, Ints
from dermis.formats.deformable_mesh import DeformableMesh, VertexMorphTarget
from dermis.formats.gltf.binary import VERTEX_TARGET, BufferBuilder
from dermis.formats.gltf.document import Tree
from dermis.mesh.eyeball import eye_uv
from dermis.mesh.head import Head

METRES_PER_MM = 1e-3
"""Length of a millimetre in metres, the unit of glTF [m]."""
_MIN_COMPACT_DISPLACEMENT_MM = 0.1  # smaller displacements are left out of compact files
_MIN_COMPACT_NORMAL_CHANGE = 0.05  # so are smaller changes of unit normals, about 3 degrees


class PrimitiveSource(Protocol):
    """Geometry that can be written as a glTF primitive with morph targets."""

    def add_primitive(self, buffer_builder: BufferBuilder) -> Tree:
        """Append the vertices and triangles of this geometry to the buffer, and return a glTF primitive.

        The caller adds the material and the morph targets to the primitive.
        """
        ...

    def add_target(self, buffer_builder: BufferBuilder, morph_target: VertexMorphTarget) -> dict[str, int]:
        """Append to the buffer how a morph target changes the vertices of this geometry.

        Returns a dictionary from attribute name to accessor index.
        """
        ...

    def is_moved_by(self, morph_target: VertexMorphTarget) -> bool:
        """Return whether a morph target changes any vertex of this geometry."""
        ...


@dataclass(frozen=True, eq=False)
class SurfacePrimitive:
    """Triangles of one material, with the vertices that they use.

    deformable : mesh of the head with its deformation
    faces : (f,) indices of the triangles
    eye : index of the eye if the triangles are a textured eyeball, else -1
    compact : whether small displacements and small changes of normals are left out of morph targets
    """

    deformable: DeformableMesh
    faces: Intp
    eye: int = -1
    compact: bool = False

    @property
    def _head(self) -> Head:
        return self.deformable.head

    @cached_property
    def used_vertices(self) -> Ints:
        """Return the indices of the mesh vertices that the triangles use, (v,), in increasing order."""
        return np.unique(self._head.mesh.triangles[self.faces])

    def add_primitive(self, buffer_builder: BufferBuilder) -> Tree:
        """Append these triangles and their vertices to the buffer, and return a glTF primitive.

        The caller adds the material and the morph targets to the primitive. The extras of the primitive say
        "quads" if its successive pairs of triangles are the halves of quads, and "alone" if it has no points
        in common with other primitives.
        """
        used, mesh = self.used_vertices, self._head.mesh
        index = buffer_builder.add_triangles(np.searchsorted(used, mesh.triangles[self.faces]), len(used))
        uv = mesh.uv[used] if self.eye < 0 else self._eye_uv()
        attributes = vertex_attributes(
            buffer_builder, self.deformable.positions_mm[used], self.deformable.normals[used], uv
        )
        attributes |= bone_attributes(buffer_builder, self.deformable, used, self.compact)
        primitive: Tree = {"attributes": attributes, "indices": index}
        flags = {"quads": self._has_quads(), "alone": self._shares_no_points()}
        extras = {key: True for key, value in flags.items() if value}
        return primitive | ({"extras": {"dermis": extras}} if extras else {})

    def add_target(self, buffer_builder: BufferBuilder, morph_target: VertexMorphTarget) -> dict[str, int]:
        """Append to the buffer how a morph target changes positions and normals of these vertices.

        Returns a dictionary from attribute name to accessor index.
        """
        used = np.flatnonzero(np.isin(morph_target.vertex, self.used_vertices, assume_unique=True))
        row = np.searchsorted(self.used_vertices, morph_target.vertex[used])
        columns = {"POSITION": to_metres(morph_target.delta_mm[used]), "NORMAL": morph_target.normal[used]}
        vertex_count = len(self.used_vertices)
        if not self.compact:
            accessors = buffer_builder.add_displacements(row, list(columns.values()), vertex_count)
            return dict(zip(columns, accessors, strict=True))
        least = METRES_PER_MM * _MIN_COMPACT_DISPLACEMENT_MM, _MIN_COMPACT_NORMAL_CHANGE
        result = dict[str, int]()
        for (name, values), smallest in zip(columns.items(), least, strict=True):
            kept = np.abs(values).max(axis=1) >= smallest
            (result[name],) = buffer_builder.add_displacements(row[kept], [values[kept]], vertex_count)
        return result

    def is_moved_by(self, morph_target: VertexMorphTarget) -> bool:
        """Return whether a morph target changes any of these vertices."""
        smallest = _MIN_COMPACT_DISPLACEMENT_MM if self.compact else 0.0
        used = np.isin(morph_target.vertex, self.used_vertices, assume_unique=True)
        return bool((np.abs(morph_target.delta_mm[used]) > smallest).any())

    def _eye_uv(self) -> Floats:
        head = self._head
        assert head.eyes is not None
        frame = head.eyes.eye_matrices(head.control_rig, head.control_rig.rest)[self.eye]
        return eye_uv(head.mesh.positions[self.used_vertices] @ frame[:3, :3].T + frame[:3, 3])

    def _has_quads(self) -> bool:
        """Return whether triangles 0 and 1, 2 and 3, and so on are the halves of quads."""
        mesh = self._head.mesh
        other = np.full(len(mesh.triangles), -1)
        other[mesh.quads[:, 0]] = mesh.quads[:, 1]
        return len(self.faces) % 2 == 0 and bool((other[self.faces[::2]] == self.faces[1::2]).all())

    def _shares_no_points(self) -> bool:
        """Return whether the triangles share no points with triangles of other materials."""
        mesh = self._head.mesh
        others = np.delete(np.arange(len(mesh.triangles)), self.faces)
        own_points, other_points = (mesh.point[mesh.triangles[part]] for part in (self.faces, others))
        return len(others) > 0 and len(np.intersect1d(own_points, other_points)) == 0


def to_metres(positions_mm: NDArray[np.floating]) -> Floats:
    """Convert lengths from millimetres to metres, the unit of glTF."""
    return (positions_mm.astype(np.float64) * METRES_PER_MM).astype(np.float32)


def vertex_attributes(
    buffer_builder: BufferBuilder, positions_mm: NDArray[np.floating], normals: Floats, uv: Floats
) -> dict[str, int]:
    """Append positions, normals and uv of vertices; return accessor indices by attribute name."""
    return {
        "POSITION": buffer_builder.add_accessor(to_metres(positions_mm), VERTEX_TARGET, with_bounds=True),
        "NORMAL": buffer_builder.add_accessor(normals, VERTEX_TARGET),
        "TEXCOORD_0": buffer_builder.add_accessor(uv, VERTEX_TARGET),
    }


def bone_attributes(
    buffer_builder: BufferBuilder,
    deformable_mesh: DeformableMesh,
    vertex_index: NDArray[np.integer],
    compact: bool,
) -> dict[str, int]:
    """Append joints and weights of vertices to the buffer; return accessor indices by attribute name.

    vertex_index : (v,) indices of the vertices in the mesh
    compact : whether to store the weights as 16-bit integers

    The result is empty for a mesh without a skeleton.
    """
    if deformable_mesh.rig.skeleton is None:
        return {}
    bone, weight = (influence[vertex_index] for influence in deformable_mesh.bone_influences)
    if not compact:
        return {
            "JOINTS_0": buffer_builder.add_accessor(bone, VERTEX_TARGET),
            "WEIGHTS_0": buffer_builder.add_accessor(weight, VERTEX_TARGET),
        }
    rounded = _normalised_levels(weight)
    return {
        "JOINTS_0": buffer_builder.add_accessor(
            np.where(rounded > 0.0, bone, bone.dtype.type(0)), VERTEX_TARGET
        ),
        "WEIGHTS_0": buffer_builder.add_normalised(rounded, VERTEX_TARGET),
    }


def _normalised_levels(weights: Floats) -> Doubles:
    """Return weights (v, 4) rounded to multiples of 1/65535 whose sums are 1."""
    levels = np.floor(65535 * weights.astype(np.float64) / weights.sum(axis=1, keepdims=True))
    levels[:, 0] += 65535 - levels.sum(axis=1)
    return np.asarray(levels / 65535)
