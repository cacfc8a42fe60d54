"""Primitives of a head that is written: one for each material, and its hairs as thin tubes of three sides."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats, Index, Intp, Ints
from dermis.formats.deformable_mesh import DeformableMesh, VertexTarget
from dermis.formats.gltf.binary import VERTICES, BufferBuilder
from dermis.formats.gltf.document import Tree
from dermis.mesh.eyeball import eye_uv
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, Strands, frames, weights

_M = 1e-3  # of a millimetre
HAIR_COLOURS = 64
"""That the hairs of a head are sorted into."""
_SIDES = 3
_RADIUS_FACTOR = (
    2.0 * np.pi / (_SIDES * np.sqrt(3.0))
)  # a triangle is as wide as a circle, seen from all around
_MIN_DISPLACEMENT_MM = 0.01  # a smaller displacement is none
_ALBEDO = 5.89  # of a fibre of roughness 0.3 among others: [Chiang2016] equation 9
_TINY = 1e-9


class PrimitiveSource(Protocol):
    """What becomes a primitive."""

    def primitive(self, binary: BufferBuilder) -> Tree:
        """Without its material and its targets."""
        ...

    def target(self, binary: BufferBuilder, target: VertexTarget) -> dict[str, int]:
        """Accessors of what a morph target does to it."""
        ...


@dataclass(frozen=True, eq=False)
class SurfacePrimitive:
    """The triangles of one material, with the vertices that they use.

    faces : (f,) of the mesh
    eye : which of the head's eyes, where it is laid out as one that is painted; -1 for none
    """

    points: DeformableMesh
    faces: Intp
    eye: int = -1

    @property
    def _head(self) -> Head:
        return self.points.head

    @cached_property
    def vertices(self) -> Ints:
        """(v,) of the mesh, in the order of the file."""
        return np.unique(self._head.mesh.triangles[self.faces])

    def primitive(self, binary: BufferBuilder) -> Tree:
        """Corners and attributes; in the extras, whether triangles are halves of quads and stand alone."""
        own, mesh = self.vertices, self._head.mesh
        index = binary.add_triangles(np.searchsorted(own, mesh.triangles[self.faces]), len(own))
        uv = mesh.uv[own] if self.eye < 0 else self._eye_uv()
        attributes = _attributes(binary, self.points.positions_mm[own], self.points.normals[own], uv)
        found: Tree = {
            "attributes": attributes | _bone_attributes(binary, self.points, own),
            "indices": index,
        }
        kept = {"quads": self._halves_of_quads(), "alone": self._alone()}
        told = {key: True for key, value in kept.items() if value}
        return found | ({"extras": {"dermis": told}} if told else {})

    def target(self, binary: BufferBuilder, target: VertexTarget) -> dict[str, int]:
        """Of positions and normals."""
        here = np.flatnonzero(np.isin(target.vertex, self.vertices, assume_unique=True))
        row = np.searchsorted(self.vertices, target.vertex[here])
        columns = [to_metres(target.delta_mm[here]), target.normal[here]]
        found = binary.add_displacements(row, columns, len(self.vertices))
        return dict(zip(("POSITION", "NORMAL"), found, strict=True))

    def _eye_uv(self) -> Floats:
        head = self._head
        assert head.eyes is not None
        frame = head.eyes.frames(head.control, head.control.rest)[self.eye]
        return eye_uv(head.mesh.positions[self.vertices] @ frame[:3, :3].T + frame[:3, 3])

    def _halves_of_quads(self) -> bool:
        """Whether of its triangles each two are the halves of a quad."""
        mesh = self._head.mesh
        other = np.full(len(mesh.triangles), -1)
        other[mesh.quads[:, 0]] = mesh.quads[:, 1]
        return len(self.faces) % 2 == 0 and bool((other[self.faces[::2]] == self.faces[1::2]).all())

    def _alone(self) -> bool:
        """Whether no other triangles have points of these."""
        mesh = self._head.mesh
        others = np.delete(np.arange(len(mesh.triangles)), self.faces)
        own, foreign = (mesh.point[mesh.triangles[part]] for part in (self.faces, others))
        return len(others) > 0 and len(np.intersect1d(own, foreign)) == 0


@dataclass(frozen=True, eq=False)
class HairPrimitive:
    """Hairs as tubes; their colours are along u of a picture of one row."""

    points: DeformableMesh
    fibres: FibreTubes

    @cached_property
    def _rest(self) -> Doubles:
        return replace(self.points.head.mesh, positions=self.points.positions_mm).points_mm

    def primitive(self, binary: BufferBuilder) -> Tree:
        """Corners and attributes; the extras tell this package to leave it out."""
        places, normals = self.fibres.posed(self._rest)
        _, uv = self.fibres.colours()
        attributes = _attributes(binary, places, normals.astype(np.float32), uv)
        attributes |= _bone_attributes(
            binary, self.points, np.repeat(self.fibres.root_vertices, self.fibres.vertices_per_hair)
        )
        index = binary.add_triangles(self.fibres.triangles(), len(places))
        return {"attributes": attributes, "indices": index, "extras": {"dermis": {"hair": True}}}

    def target(self, binary: BufferBuilder, target: VertexTarget) -> dict[str, int]:
        """Of positions alone."""
        delta, mesh = np.zeros_like(self._rest), self.points.head.mesh
        delta[mesh.point[target.vertex]] = target.delta_mm
        vertex, moved = self.fibres.displacements_at(self._rest, delta)
        (found,) = binary.add_displacements(vertex, [to_metres(moved)], self.fibres.vertex_count)
        return {"POSITION": found}


def to_metres(places_mm: NDArray[np.floating]) -> Floats:
    """In the file's unit."""
    return (places_mm.astype(np.float64) * _M).astype(np.float32)


def _attributes(
    binary: BufferBuilder, places_mm: NDArray[np.floating], normals: Floats, uv: Floats
) -> dict[str, int]:
    return {
        "POSITION": binary.add_accessor(to_metres(places_mm), VERTICES, bounded=True),
        "NORMAL": binary.add_accessor(normals, VERTICES),
        "TEXCOORD_0": binary.add_accessor(uv, VERTICES),
    }


def _bone_attributes(
    binary: BufferBuilder, points: DeformableMesh, vertex: NDArray[np.integer]
) -> dict[str, int]:
    """What some vertices of the mesh follow."""
    if points.rig.skeleton is None:
        return {}
    bone, share = points.bones
    return {
        "JOINTS_0": binary.add_accessor(bone[vertex], VERTICES),
        "WEIGHTS_0": binary.add_accessor(share[vertex], VERTICES),
    }


@dataclass(frozen=True, eq=False)
class FibreTubes:
    """Tubes around hairs; they keep their shape and turn with the quads that they are rooted in.

    mesh : in whose quads
    """

    strands: Strands
    mesh: Mesh

    @classmethod
    def from_strands(cls, strands: Strands, mesh: Mesh, most: int, knots: int) -> FibreTubes:
        """The first hairs, so many at most, as wide as all together, bent at fewer knots."""
        kept = min(len(strands), most)
        wider = len(strands) / kept
        roots = Roots(strands.roots.quad[:kept], strands.roots.place[:kept])
        knot = np.rint(np.linspace(0, strands.knots_mm.shape[1] - 1, knots)).astype(int)
        fewer = replace(
            strands,
            roots=roots,
            knots_mm=strands.knots_mm[:kept][:, knot],
            radius_mm=np.float32(wider) * strands.radius_mm[:kept][:, knot],
            absorption=strands.absorption[:kept] / np.float32(wider),
            cover=None,
        )
        return cls(fewer, mesh)

    @property
    def _knots(self) -> int:
        return int(self.strands.knots_mm.shape[1])

    @property
    def vertices_per_hair(self) -> int:
        """Vertices of a hair: rings around all knots but the last, the tip."""
        return _SIDES * (self._knots - 1) + 1

    @property
    def vertex_count(self) -> int:
        """Vertices of all."""
        return self.vertices_per_hair * len(self.strands)

    @property
    def root_vertices(self) -> Intp:
        """(n,) the mesh's vertex nearest to each root."""
        nearest = weights(self.strands.roots.place).argmax(axis=1)
        first, second = self.mesh.quads[self.strands.roots.quad].T
        around = np.column_stack([self.mesh.triangles[first], self.mesh.triangles[second, 1]])
        return np.asarray(around[np.arange(len(around)), nearest], np.intp)

    @cached_property
    def _rings(self) -> tuple[Doubles, Doubles]:
        """Places (n, m, 3) and unit normals of the vertices, seen from the roots [mm]."""
        knots = self.strands.knots_mm.astype(np.float64)
        along = np.gradient(knots, axis=1)
        along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), _TINY)
        angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
        side = np.eye(3)[np.abs(along[:, 0]).argmin(axis=1)]
        places, normals = list[Doubles](), list[Doubles]()
        for k in range(self._knots - 1):
            side = side - (side * along[:, k]).sum(axis=1, keepdims=True) * along[:, k]
            side = side / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), _TINY)
            both = np.stack([side, np.cross(along[:, k], side)], axis=1)
            out = np.einsum("sj,njc->nsc", np.stack([np.cos(angle), np.sin(angle)], axis=1), both)
            places.append(knots[:, k, None] + _RADIUS_FACTOR * self.strands.radius_mm[:, k, None, None] * out)
            normals.append(out)
        return (
            np.concatenate([*places, knots[:, -1:]], axis=1),
            np.concatenate([*normals, along[:, -1:]], axis=1),
        )

    def posed(self, points_mm: NDArray[np.floating]) -> tuple[Doubles, Doubles]:
        """Places (n m, 3) [mm] and normals of all vertices where the points of the mesh (p, 3) are."""
        root, frame = frames(self.mesh, self.strands.roots, points_mm)
        places, normals = (np.einsum("nic,nki->nkc", frame, part) for part in self._rings)
        return (root[:, None] + places).reshape(-1, 3), normals.reshape(-1, 3)

    def displacements_at(self, points_mm: Doubles, delta_mm: Doubles) -> tuple[Index, Doubles]:
        """Vertices (n,) that move when the points of the mesh do, and by how much (n, 3) [mm]."""
        first, second = self.mesh.quads[self.strands.roots.quad].T
        around = self.mesh.point[np.column_stack([self.mesh.triangles[first], self.mesh.triangles[second]])]
        hair = np.flatnonzero((np.abs(delta_mm).max(axis=1) > 0)[around].any(axis=1))
        roots, places = self.strands.roots, self._rings[0][hair]
        roots = Roots(roots.quad[hair], roots.place[hair])
        (before, rest), (after, frame) = (
            frames(self.mesh, roots, points) for points in (points_mm, points_mm + delta_mm)
        )
        delta = (after - before)[:, None] + np.einsum("nic,nki->nkc", frame - rest, places)
        far = np.flatnonzero(np.abs(delta).max(axis=(1, 2), initial=0.0) >= _MIN_DISPLACEMENT_MM)
        vertex = hair[far][:, None] * self.vertices_per_hair + np.arange(self.vertices_per_hair)
        return vertex.ravel(), delta[far].reshape(-1, 3)

    def triangles(self) -> Index:
        """(f, 3) vertices."""
        one, ahead = np.arange(_SIDES), (np.arange(_SIDES) + 1) % _SIDES
        faces = list[Index]()
        for k in range(self._knots - 2):
            a, b = _SIDES * k + one, _SIDES * k + ahead
            faces += [np.stack([a, b, b + _SIDES], axis=1), np.stack([a, b + _SIDES, a + _SIDES], axis=1)]
        last = _SIDES * (self._knots - 2)
        faces.append(
            np.stack([last + one, last + ahead, np.full(_SIDES, self.vertices_per_hair - 1)], axis=1)
        )
        begin = self.vertices_per_hair * np.arange(len(self.strands))
        return np.asarray((begin[:, None, None] + np.concatenate(faces)).reshape(-1, 3), np.int64)

    def colours(self) -> tuple[Floats, Floats]:
        """A row of colours (1, c, 3), linear, and the uv (n m, 2) of each vertex in it."""
        through = self.strands.absorption * self.strands.radius_mm.max(axis=1, keepdims=True)
        albedo = np.exp(-_ALBEDO * np.sqrt(through.astype(np.float64)))
        order = np.argsort(albedo.sum(axis=1), kind="stable")
        group = np.empty(len(order), np.int64)
        group[order] = np.arange(len(order)) * HAIR_COLOURS // len(order)
        sums = np.stack([np.bincount(group, albedo[:, c], HAIR_COLOURS) for c in range(3)], axis=-1)
        row = sums / np.maximum(np.bincount(group, minlength=HAIR_COLOURS), 1)[:, None]
        u = np.repeat((group + 0.5) / HAIR_COLOURS, self.vertices_per_hair)
        return row[None].astype(np.float32), np.stack([u, np.full_like(u, 0.5)], axis=1).astype(np.float32)
