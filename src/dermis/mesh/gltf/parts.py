"""Primitives of a head that is written: those of its mesh, one for each material, and those of its hairs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.eye_layout import eye_uv
from dermis.mesh.gltf.binary import VERTICES, Binary
from dermis.mesh.gltf.fibres import Fibres, rest_points
from dermis.mesh.gltf.moved_points import MovedPoints, Target
from dermis.mesh.head import Head

Doubles = NDArray[np.float64]
Floats = NDArray[np.float32]
Tree = dict[str, Any]

_M = 1e-3  # of a millimetre


class Part(Protocol):
    """What becomes a primitive."""

    def primitive(self, binary: Binary) -> Tree:
        """Without its material and its targets."""
        ...

    def target(self, binary: Binary, target: Target) -> dict[str, int]:
        """Accessors of what a morph target does to it."""
        ...


@dataclass(frozen=True, eq=False)
class Surface:
    """The triangles of one material, with the vertices that they use.

    faces : (f,) of the mesh
    eye : which of the head's eyes, where it is laid out as one that is painted; -1 for none
    """

    points: MovedPoints
    faces: NDArray[np.intp]
    eye: int = -1

    @property
    def _head(self) -> Head:
        return self.points.head

    @cached_property
    def vertices(self) -> NDArray[np.int32]:
        """(v,) of the mesh, in the order of the file."""
        return np.unique(self._head.mesh.triangles[self.faces])

    def primitive(self, binary: Binary) -> Tree:
        """Corners and attributes; in the extras, whether triangles are halves of quads and stand alone."""
        own, mesh = self.vertices, self._head.mesh
        index = binary.triangles(np.searchsorted(own, mesh.triangles[self.faces]), len(own))
        uv = mesh.uv[own] if self.eye < 0 else self._eye_uv()
        attributes = _attributes(binary, self.points.positions_mm[own], self.points.normals[own], uv)
        found: Tree = {"attributes": attributes | _bones(binary, self.points, own), "indices": index}
        kept = {"quads": self._halves_of_quads(), "alone": self._alone()}
        told = {key: True for key, value in kept.items() if value}
        return found | ({"extras": {"dermis": told}} if told else {})

    def target(self, binary: Binary, target: Target) -> dict[str, int]:
        """Of positions and normals."""
        here = np.flatnonzero(np.isin(target.vertex, self.vertices, assume_unique=True))
        row = np.searchsorted(self.vertices, target.vertex[here])
        columns = [metres(target.delta_mm[here]), target.normal[here]]
        found = binary.displacements(row, columns, len(self.vertices))
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
class Hairs:
    """Hairs as tubes; their colours are along u of a picture of one row."""

    points: MovedPoints
    fibres: Fibres

    @cached_property
    def _rest(self) -> Doubles:
        return rest_points(self.points.head.mesh, self.points.positions_mm)

    def primitive(self, binary: Binary) -> Tree:
        """Corners and attributes; the extras tell this package to leave it out."""
        places, normals = self.fibres.placed(self._rest)
        _, uv = self.fibres.colours()
        attributes = _attributes(binary, places, normals.astype(np.float32), uv)
        attributes |= _bones(binary, self.points, np.repeat(self.fibres.vertex, self.fibres.each))
        index = binary.triangles(self.fibres.triangles(), len(places))
        return {"attributes": attributes, "indices": index, "extras": {"dermis": {"hair": True}}}

    def target(self, binary: Binary, target: Target) -> dict[str, int]:
        """Of positions alone."""
        delta, mesh = np.zeros_like(self._rest), self.points.head.mesh
        delta[mesh.point[target.vertex]] = target.delta_mm
        vertex, moved = self.fibres.moved(self._rest, delta)
        (found,) = binary.displacements(vertex, [metres(moved)], self.fibres.count)
        return {"POSITION": found}


def metres(places_mm: NDArray[np.floating]) -> Floats:
    """In the file's unit."""
    return (places_mm.astype(np.float64) * _M).astype(np.float32)


def _attributes(
    binary: Binary, places_mm: NDArray[np.floating], normals: Floats, uv: Floats
) -> dict[str, int]:
    return {
        "POSITION": binary.array(metres(places_mm), VERTICES, bounded=True),
        "NORMAL": binary.array(normals, VERTICES),
        "TEXCOORD_0": binary.array(uv, VERTICES),
    }


def _bones(binary: Binary, points: MovedPoints, vertex: NDArray[np.integer]) -> dict[str, int]:
    """What some vertices of the mesh follow."""
    if points.rig.skeleton is None:
        return {}
    bone, share = points.bones
    return {
        "JOINTS_0": binary.array(bone[vertex], VERTICES),
        "WEIGHTS_0": binary.array(share[vertex], VERTICES),
    }
