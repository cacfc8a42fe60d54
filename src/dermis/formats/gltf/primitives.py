"""Primitives of exported glTF heads: triangles of each material, and hairs as thin three-sided tubes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Index, Intp, Ints
from dermis.formats.deformable_mesh import DeformableMesh, VertexMorphTarget
from dermis.formats.gltf.binary import VERTEX_TARGET, BufferBuilder
from dermis.formats.gltf.document import Tree
from dermis.mesh.eyeball import eye_uv
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, Strands, quad_weights, root_frames

_METRES_PER_MM = 1e-3
HAIR_COLOUR_COUNT = 64
"""Number of colours into which the hairs of a head are sorted."""
_TUBE_SIDES = 3
# makes a tube as wide on average as a round hair
_TUBE_RADIUS_PER_HAIR_RADIUS = 2.0 * np.pi / (_TUBE_SIDES * np.sqrt(3.0))
_MIN_DISPLACEMENT_MM = 0.01  # smaller displacements count as 0
_HAIR_ALBEDO_EXPONENT = 5.89  # for fibres of roughness 0.3: [Chiang2016] equation 9
_MIN_VECTOR_LENGTH = 1e-9


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


@dataclass(frozen=True, eq=False)
class SurfacePrimitive:
    """Triangles of one material, with the vertices that they use.

    deformable : mesh of the head with its deformation
    faces : (f,) indices of the triangles
    eye : index of the eye if the triangles are a textured eyeball, else -1
    """

    deformable: DeformableMesh
    faces: Intp
    eye: int = -1

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
        attributes = _vertex_attributes(
            buffer_builder, self.deformable.positions_mm[used], self.deformable.normals[used], uv
        )
        attributes |= _bone_attributes(buffer_builder, self.deformable, used)
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
        columns = [to_metres(morph_target.delta_mm[used]), morph_target.normal[used]]
        accessors = buffer_builder.add_displacements(row, columns, len(self.used_vertices))
        return dict(zip(("POSITION", "NORMAL"), accessors, strict=True))

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


@dataclass(frozen=True, eq=False)
class HairPrimitive:
    """Hairs on a head, written as thin tubes that are coloured by a texture with a single row of texels.

    deformable : mesh of the head with its deformation
    fibres : tubes around the hairs
    """

    deformable: DeformableMesh
    fibres: FibreTubes

    @cached_property
    def _rest_points(self) -> Doubles:
        return replace(self.deformable.head.mesh, positions=self.deformable.positions_mm).points_mm

    def add_primitive(self, buffer_builder: BufferBuilder) -> Tree:
        """Append the vertices and triangles of the hair tubes to the buffer, and return a glTF primitive.

        The caller adds the material and the morph targets to the primitive. The extras of the primitive mark
        it as hair, so that `read_gltf` skips it.
        """
        positions, normals = self.fibres.pose_vertices(self._rest_points)
        _, uv = self.fibres.palette_and_uv()
        attributes = _vertex_attributes(buffer_builder, positions, normals.astype(np.float32), uv)
        attributes |= _bone_attributes(
            buffer_builder,
            self.deformable,
            np.repeat(self.fibres.root_vertices, self.fibres.vertices_per_hair),
        )
        index = buffer_builder.add_triangles(self.fibres.triangles(), len(positions))
        return {"attributes": attributes, "indices": index, "extras": {"dermis": {"hair": True}}}

    def add_target(self, buffer_builder: BufferBuilder, morph_target: VertexMorphTarget) -> dict[str, int]:
        """Append to the buffer how a morph target displaces the vertices of the hair tubes.

        Returns {"POSITION": index of the accessor of the displacements}.
        """
        delta, mesh = np.zeros_like(self._rest_points), self.deformable.head.mesh
        delta[mesh.point[morph_target.vertex]] = morph_target.delta_mm
        vertex, displacement = self.fibres.tube_displacements(self._rest_points, delta)
        (accessor,) = buffer_builder.add_displacements(
            vertex, [to_metres(displacement)], self.fibres.vertex_count
        )
        return {"POSITION": accessor}


def to_metres(positions_mm: NDArray[np.floating]) -> Floats:
    """Convert lengths from millimetres to metres, the unit of glTF."""
    return (positions_mm.astype(np.float64) * _METRES_PER_MM).astype(np.float32)


def _vertex_attributes(
    buffer_builder: BufferBuilder, positions_mm: NDArray[np.floating], normals: Floats, uv: Floats
) -> dict[str, int]:
    return {
        "POSITION": buffer_builder.add_accessor(to_metres(positions_mm), VERTEX_TARGET, with_bounds=True),
        "NORMAL": buffer_builder.add_accessor(normals, VERTEX_TARGET),
        "TEXCOORD_0": buffer_builder.add_accessor(uv, VERTEX_TARGET),
    }


def _bone_attributes(
    buffer_builder: BufferBuilder, deformable_mesh: DeformableMesh, vertex_index: NDArray[np.integer]
) -> dict[str, int]:
    """Append joints and weights of vertices to the buffer; return accessor indices by attribute name.

    vertex_index : (v,) indices of the vertices in the mesh

    The result is empty for a mesh without a skeleton.
    """
    if deformable_mesh.rig.skeleton is None:
        return {}
    bone, weight = deformable_mesh.bone_influences
    return {
        "JOINTS_0": buffer_builder.add_accessor(bone[vertex_index], VERTEX_TARGET),
        "WEIGHTS_0": buffer_builder.add_accessor(weight[vertex_index], VERTEX_TARGET),
    }


@dataclass(frozen=True, eq=False)
class FibreTubes:
    """Thin three-sided tubes that represent n hairs, with m vertices in each tube.

    Each tube is rigid and moves with the skin at the root of its hair.

    strands : the n hairs
    mesh : mesh of the skin on which the hairs grow
    """

    strands: Strands
    mesh: Mesh

    @classmethod
    def from_strands(cls, strands: Strands, mesh: Mesh, max_hairs: int, knot_count: int) -> FibreTubes:
        """Return tubes around the first `max_hairs` hairs, through `knot_count` points along each hair.

        If hairs are left out, the tubes are widened to cover the same area in total, and their absorption
        is reduced accordingly.

        strands : all hairs
        mesh : mesh of the skin on which the hairs grow
        """
        count = min(len(strands), max_hairs)
        width_factor = len(strands) / count
        roots = Roots(strands.roots.quad[:count], strands.roots.position[:count])
        knot = np.rint(np.linspace(0, strands.knots_mm.shape[1] - 1, knot_count)).astype(int)
        reduced = replace(
            strands,
            roots=roots,
            knots_mm=strands.knots_mm[:count][:, knot],
            radius_mm=np.float32(width_factor) * strands.radius_mm[:count][:, knot],
            absorption=strands.absorption[:count] / np.float32(width_factor),
            cover=None,
        )
        return cls(reduced, mesh)

    @property
    def _knot_count(self) -> int:
        return int(self.strands.knots_mm.shape[1])

    @property
    def vertices_per_hair(self) -> int:
        """Return the number m of vertices of a tube: three in each ring along it, and one at its tip."""
        return _TUBE_SIDES * (self._knot_count - 1) + 1

    @property
    def vertex_count(self) -> int:
        """Return the number of vertices of the tubes of all hairs, n * m."""
        return self.vertices_per_hair * len(self.strands)

    @property
    def root_vertices(self) -> Intp:
        """Return the index of the skin vertex nearest to the root of each hair, (n,)."""
        nearest = quad_weights(self.strands.roots.position).argmax(axis=1)
        first, second = self.mesh.quads[self.strands.roots.quad].T
        corners = np.column_stack([self.mesh.triangles[first], self.mesh.triangles[second, 1]])
        return np.asarray(corners[np.arange(len(corners)), nearest], np.intp)

    @cached_property
    def _tube_rings(self) -> tuple[Doubles, Doubles]:
        """Return the vertices [mm] and normals of the tubes, in the frame at the root of each hair.

        Both arrays are (n, m, 3): m vertices for each of the n hairs. The frames are those of `root_frames`.
        """
        knots = self.strands.knots_mm.astype(np.float64)
        tangent = np.gradient(knots, axis=1)
        tangent /= np.maximum(np.linalg.norm(tangent, axis=2, keepdims=True), _MIN_VECTOR_LENGTH)
        angle = 2.0 * np.pi * np.arange(_TUBE_SIDES) / _TUBE_SIDES
        side = np.eye(3)[np.abs(tangent[:, 0]).argmin(axis=1)]
        positions, normals = list[Doubles](), list[Doubles]()
        for k in range(self._knot_count - 1):
            side = side - (side * tangent[:, k]).sum(axis=1, keepdims=True) * tangent[:, k]
            side = side / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), _MIN_VECTOR_LENGTH)
            basis = np.stack([side, np.cross(tangent[:, k], side)], axis=1)
            outward = np.einsum("sj,njc->nsc", np.stack([np.cos(angle), np.sin(angle)], axis=1), basis)
            radius_mm = _TUBE_RADIUS_PER_HAIR_RADIUS * self.strands.radius_mm[:, k, None, None]
            positions.append(knots[:, k, None] + radius_mm * outward)
            normals.append(outward)
        all_positions = np.concatenate([*positions, knots[:, -1:]], axis=1)
        return all_positions, np.concatenate([*normals, tangent[:, -1:]], axis=1)

    def pose_vertices(self, points_mm: NDArray[np.floating]) -> tuple[Doubles, Doubles]:
        """Return the vertices [mm] and normals of the tubes on the posed skin, (n * m, 3) each.

        The m vertices of the first hair come first, then those of the second hair, and so on.

        points_mm : (p, 3) points of the skin mesh in this pose
        """
        root, frame = root_frames(self.mesh, self.strands.roots, points_mm)
        offsets, normals = (np.einsum("nic,nki->nkc", frame, part) for part in self._tube_rings)
        return (root[:, None] + offsets).reshape(-1, 3), normals.reshape(-1, 3)

    def tube_displacements(self, points_mm: Doubles, delta_mm: Doubles) -> tuple[Index, Doubles]:
        """Return the k tube vertices that move when the skin is displaced.

        Returns their indices (k,) and displacements (k, 3) [mm].

        points_mm : (p, 3) points of the skin mesh at rest
        delta_mm : (p, 3) displacements of these points
        """
        first, second = self.mesh.quads[self.strands.roots.quad].T
        corners = self.mesh.point[np.column_stack([self.mesh.triangles[first], self.mesh.triangles[second]])]
        hair = np.flatnonzero((np.abs(delta_mm).max(axis=1) > 0)[corners].any(axis=1))
        roots, offsets = self.strands.roots, self._tube_rings[0][hair]
        roots = Roots(roots.quad[hair], roots.position[hair])
        (before, rest), (after, frame) = (
            root_frames(self.mesh, roots, points) for points in (points_mm, points_mm + delta_mm)
        )
        delta = (after - before)[:, None] + np.einsum("nic,nki->nkc", frame - rest, offsets)
        moving = np.flatnonzero(np.abs(delta).max(axis=(1, 2), initial=0.0) >= _MIN_DISPLACEMENT_MM)
        vertex = hair[moving][:, None] * self.vertices_per_hair + np.arange(self.vertices_per_hair)
        return vertex.ravel(), delta[moving].reshape(-1, 3)

    def triangles(self) -> Index:
        """Return the vertex indices of the f triangles of all tubes, (f, 3)."""
        side, following = np.arange(_TUBE_SIDES), (np.arange(_TUBE_SIDES) + 1) % _TUBE_SIDES
        faces = list[Index]()
        for k in range(self._knot_count - 2):
            a, b = _TUBE_SIDES * k + side, _TUBE_SIDES * k + following
            faces += [
                np.stack([a, b, b + _TUBE_SIDES], axis=1),
                np.stack([a, b + _TUBE_SIDES, a + _TUBE_SIDES], axis=1),
            ]
        last = _TUBE_SIDES * (self._knot_count - 2)
        tip = np.full(_TUBE_SIDES, self.vertices_per_hair - 1)
        faces.append(np.stack([last + side, last + following, tip], axis=1))
        start = self.vertices_per_hair * np.arange(len(self.strands))
        return np.asarray((start[:, None, None] + np.concatenate(faces)).reshape(-1, 3), np.int64)

    def palette_and_uv(self) -> tuple[Floats, Floats]:
        """Return a palette of hair colours as a texture, and the uv of all tube vertices in this texture.

        The texture (1, c, 3) is a row of c linear colours; each hair has one of them. The uv are (n * m, 2).
        """
        absorbance = self.strands.absorption * self.strands.radius_mm.max(axis=1, keepdims=True)
        albedo = np.exp(-_HAIR_ALBEDO_EXPONENT * np.sqrt(absorbance.astype(np.float64)))
        order = np.argsort(albedo.sum(axis=1), kind="stable")
        group = np.empty(len(order), np.int64)
        group[order] = np.arange(len(order)) * HAIR_COLOUR_COUNT // len(order)
        sums = np.stack([np.bincount(group, albedo[:, c], HAIR_COLOUR_COUNT) for c in range(3)], axis=-1)
        row = sums / np.maximum(np.bincount(group, minlength=HAIR_COLOUR_COUNT), 1)[:, None]
        u = np.repeat((group + 0.5) / HAIR_COLOUR_COUNT, self.vertices_per_hair)
        return row[None].astype(np.float32), np.stack([u, np.full_like(u, 0.5)], axis=1).astype(np.float32)
