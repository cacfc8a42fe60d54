"""What moves a mesh that is written: targets and bones of its control points, carried to finer ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.geometry import vertex_normals
from dermis.mesh.gltf.influences import influences
from dermis.mesh.head import Head
from dermis.mesh.rig import Rig

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Doubles = NDArray[np.float64]
Floats = NDArray[np.float32]
Index = NDArray[np.int64]

_LEAST_MM = 1e-3  # a smaller displacement is none
_LEAST_TURN = 2e-3  # of a normal, a tenth of a degree


class Target(NamedTuple):
    """Vertices that a morph target moves, by how much at weight 1, and what that adds to their normals.

    vertex : (n,)
    delta_mm, normal : (n, 3)
    """

    vertex: Index
    delta_mm: Floats
    normal: Floats


@dataclass(frozen=True)
class MovedPoints:
    """The vertices of a head's mesh, and what moves them."""

    head: Head

    @property
    def rig(self) -> Rig:
        """Of the control points."""
        return self.head.control

    @cached_property
    def finer(self) -> csr_array | None:
        """(q, p) the points of the mesh as means of control points; None where they are the same."""
        from scipy.sparse import csr_array

        stencils = self.rig.stencils
        if stencils is None:
            return None
        shape = (len(stencils.first) - 1, len(self.rig.positions_mm))
        return csr_array((stencils.weight.astype(np.float64), stencils.point, stencils.first), shape=shape)

    @cached_property
    def positions_mm(self) -> Floats:
        """(v, 3) where vertices lie with all targets at 0 [mm]."""
        mesh, rest = self.head.mesh, self.rig.targets.rest
        if rest is None:
            return mesh.positions
        control = np.zeros((len(self.rig.positions_mm), 3))
        for number, weight in enumerate(rest.tolist()):
            control += weight * self._control_mm(number)
        return (mesh.positions - self._carried(control)[mesh.point]).astype(np.float32)

    @cached_property
    def normals(self) -> Floats:
        """(v, 3) normals there."""
        return self._smooth if self.rig.targets.rest is not None else self.head.mesh.normals

    @cached_property
    def _smooth(self) -> Floats:
        mesh = self.head.mesh
        return vertex_normals(self.positions_mm, mesh.point, mesh.triangles)

    def targets(self) -> Iterator[Target]:
        """Each of the morph targets."""
        mesh = self.head.mesh
        for number in range(len(self.rig.targets.names)):
            delta = self._carried(self._control_mm(number))
            delta[np.abs(delta).max(axis=1) < _LEAST_MM] = 0.0
            moved = delta[mesh.point].astype(np.float32)
            turned = self._turned(moved)
            vertex = np.flatnonzero(moved.any(axis=1) | turned.any(axis=1))
            yield Target(vertex, moved[vertex], turned[vertex])

    def _turned(self, moved: Floats) -> Floats:
        """(v, 3) what displacements [mm] add to the normals, by the triangles around them."""
        mesh, found = self.head.mesh, np.zeros_like(moved)
        moves = np.asarray(moved.any(axis=1))
        changed = moves[mesh.triangles].any(axis=1)
        touched = np.zeros(int(mesh.point.max()) + 1, bool)
        touched[mesh.point[mesh.triangles[changed]]] = True
        around = mesh.triangles[touched[mesh.point[mesh.triangles]].any(axis=1)]
        if not len(around):
            return found
        vertex, corner = np.unique(around, return_inverse=True)
        point = np.unique(mesh.point[vertex], return_inverse=True)[1].astype(np.int32)
        places, triangles = self.positions_mm[vertex] + moved[vertex], corner.reshape(-1, 3).astype(np.int32)
        found[vertex] = vertex_normals(places, point, triangles) - self._smooth[vertex]
        found[~touched[mesh.point] | (np.abs(found).max(axis=1) < _LEAST_TURN)] = 0.0
        return found

    @cached_property
    def bones(self) -> tuple[NDArray[Any], Floats]:
        """(v, 4) bones that each vertex follows, and by what share."""
        bone, share = influences(self.rig, self.finer)
        kind = np.uint8 if bone.max() < 256 else np.uint16
        point = self.head.mesh.point
        return bone[point].astype(kind), share[point].astype(np.float32)

    def _control_mm(self, target: int) -> Doubles:
        """(p, 3) displacements of the control points."""
        targets, found = self.rig.targets, np.zeros((len(self.rig.positions_mm), 3))
        part = targets.of(target)
        found[targets.point[part]] = targets.delta_mm[part]
        return found

    def _carried(self, control: Doubles) -> Doubles:
        """(q, 3) of the points of the mesh."""
        return control if self.finer is None else np.asarray(self.finer @ control)
