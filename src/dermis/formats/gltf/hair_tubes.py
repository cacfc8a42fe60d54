"""Hairs that move with the skin, as thin three-sided tubes in exported glTF heads."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Index
from dermis.formats.deformable_mesh import DeformableMesh, VertexMorphTarget
from dermis.formats.gltf.binary import BufferBuilder
from dermis.formats.gltf.document import Tree
from dermis.formats.gltf.hair_colours import HAIR_COLOUR_COUNT, grouped_colours
from dermis.formats.gltf.primitives import bone_attributes, to_metres, vertex_attributes
from dermis.mesh.mesh import Mesh
from dermis.mesh.strand_groups import moved_strands, root_vertices
from dermis.mesh.strands import Roots, Strands, root_frames

_TUBE_SIDES = 3
# ratio at which a tube is as wide on average as a round hair
_TUBE_RADIUS_PER_HAIR_RADIUS = 2.0 * np.pi / (_TUBE_SIDES * np.sqrt(3.0))
_MIN_DISPLACEMENT_MM = 0.1  # smaller displacements count as 0
_MIN_VECTOR_LENGTH = 1e-9


@dataclass(frozen=True, eq=False)
class TubePrimitive:
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
        attributes = vertex_attributes(buffer_builder, positions, normals.astype(np.float32), uv)
        attributes |= bone_attributes(
            buffer_builder,
            self.deformable,
            np.repeat(
                root_vertices(self.fibres.mesh, self.fibres.strands.roots), self.fibres.vertices_per_hair
            ),
            compact=True,
        )
        index = buffer_builder.add_triangles(self.fibres.triangles(), len(positions))
        return {"attributes": attributes, "indices": index, "extras": {"dermis": {"hair": True}}}

    def add_target(self, buffer_builder: BufferBuilder, morph_target: VertexMorphTarget) -> dict[str, int]:
        """Append to the buffer how a morph target displaces the vertices of the hair tubes.

        Returns {"POSITION": index of the accessor of the displacements}.
        """
        vertex, displacement = self._displacements(morph_target)
        (accessor,) = buffer_builder.add_displacements(
            vertex, [to_metres(displacement)], self.fibres.vertex_count
        )
        return {"POSITION": accessor}

    def is_moved_by(self, morph_target: VertexMorphTarget) -> bool:
        """Return whether a morph target moves any of the hairs."""
        return len(self._displacements(morph_target)[0]) > 0

    def _displacements(self, morph_target: VertexMorphTarget) -> tuple[Index, Doubles]:
        delta, mesh = np.zeros_like(self._rest_points), self.deformable.head.mesh
        delta[mesh.point[morph_target.vertex]] = morph_target.delta_mm
        return self.fibres.tube_displacements(self._rest_points, delta)


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
            is_lash=None,
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
        hair, delta = moved_strands(
            self.mesh, self.strands.roots, self._tube_rings[0], points_mm, delta_mm, _MIN_DISPLACEMENT_MM
        )
        vertex = hair[:, None] * self.vertices_per_hair + np.arange(self.vertices_per_hair)
        return vertex.ravel(), delta.reshape(-1, 3)

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
        row, group = grouped_colours(self.strands)
        u = np.repeat((group + 0.5) / HAIR_COLOUR_COUNT, self.vertices_per_hair)
        return row[None].astype(np.float32), np.stack([u, np.full_like(u, 0.5)], axis=1).astype(np.float32)
