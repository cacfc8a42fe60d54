"""Deformation of exported meshes: morph targets and bone weights of refined vertices.

Other programs use four bones per vertex. For vertices of a refined mesh these are chosen so that rotations
move them to where the rotated control points would.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index, Numbers
from dermis.mesh.geometry import vertex_normals
from dermis.mesh.head import Head
from dermis.mesh.rig import Rig
from dermis.mesh.skeleton import INFLUENCES, Skeleton

if TYPE_CHECKING:
    from scipy.sparse import csr_array


_MIN_DISPLACEMENT_MM = 1e-3  # smaller displacements count as 0
_MIN_NORMAL_CHANGE = 2e-3  # of a unit normal, a tenth of a degree
_MIN_WEIGHT = 1e-6  # smaller weights count as 0
_MAX_CANDIDATES = 8  # bones among which four are selected
_PRIOR_MM2 = 1.0  # penalty for deviations from the interpolated weights


class VertexTarget(NamedTuple):
    """Morph target of a mesh: displaced vertices, and their changes at weight 1.

    vertex : (n,)
    delta_mm, normal : (n, 3) changes of position and normal
    """

    vertex: Index
    delta_mm: Floats
    normal: Floats


@dataclass(frozen=True)
class DeformableMesh:
    """Vertices of a head's mesh, with morph targets and bone weights."""

    head: Head

    @property
    def rig(self) -> Rig:
        """Return the rig of the control points."""
        return self.head.control

    @cached_property
    def refinement(self) -> csr_array | None:
        """Return the matrix (q, p) from control points to mesh points, or None if they are the same."""
        from scipy.sparse import csr_array

        stencils = self.rig.stencils
        if stencils is None:
            return None
        shape = (len(stencils.first) - 1, len(self.rig.positions_mm))
        return csr_array((stencils.weight.astype(np.float64), stencils.point, stencils.first), shape=shape)

    @cached_property
    def positions_mm(self) -> Floats:
        """Return the vertex positions with all target weights at 0, (v, 3) [mm]."""
        mesh, rest = self.head.mesh, self.rig.targets.rest
        if rest is None:
            return mesh.positions
        displacement = np.zeros((len(self.rig.positions_mm), 3))
        for number, weight in enumerate(rest.tolist()):
            displacement += weight * self._control_displacements(number)
        return (mesh.positions - self._refine(displacement)[mesh.point]).astype(np.float32)

    @cached_property
    def normals(self) -> Floats:
        """Return the vertex normals at `positions_mm`, (v, 3)."""
        return self._smooth_normals if self.rig.targets.rest is not None else self.head.mesh.normals

    @cached_property
    def _smooth_normals(self) -> Floats:
        mesh = self.head.mesh
        return vertex_normals(self.positions_mm, mesh.point, mesh.triangles)

    def targets(self) -> Iterator[VertexTarget]:
        """Yield each morph target."""
        mesh = self.head.mesh
        for number in range(len(self.rig.targets.names)):
            delta = self._refine(self._control_displacements(number))
            delta[np.abs(delta).max(axis=1) < _MIN_DISPLACEMENT_MM] = 0.0
            delta_mm = delta[mesh.point].astype(np.float32)
            normal = self._normal_changes(delta_mm)
            vertex = np.flatnonzero(delta_mm.any(axis=1) | normal.any(axis=1))
            yield VertexTarget(vertex, delta_mm[vertex], normal[vertex])

    def _normal_changes(self, delta_mm: Floats) -> Floats:
        """Return the changes of vertex normals due to displacements [mm], (v, 3)."""
        mesh, change = self.head.mesh, np.zeros_like(delta_mm)
        moves = np.asarray(delta_mm.any(axis=1))
        changed = moves[mesh.triangles].any(axis=1)
        touched = np.zeros(int(mesh.point.max()) + 1, bool)
        touched[mesh.point[mesh.triangles[changed]]] = True
        nearby = mesh.triangles[touched[mesh.point[mesh.triangles]].any(axis=1)]
        if not len(nearby):
            return change
        vertex, corner = np.unique(nearby, return_inverse=True)
        point = np.unique(mesh.point[vertex], return_inverse=True)[1].astype(np.int32)
        positions = self.positions_mm[vertex] + delta_mm[vertex]
        triangles = corner.reshape(-1, 3).astype(np.int32)
        change[vertex] = vertex_normals(positions, point, triangles) - self._smooth_normals[vertex]
        change[~touched[mesh.point] | (np.abs(change).max(axis=1) < _MIN_NORMAL_CHANGE)] = 0.0
        return change

    @cached_property
    def bone_influences(self) -> tuple[Numbers, Floats]:
        """Return four bones and weights of each vertex, (v, 4) each."""
        bone, weight = influences(self.rig, self.refinement)
        dtype = np.uint8 if bone.max() < 256 else np.uint16
        point = self.head.mesh.point
        return bone[point].astype(dtype), weight[point].astype(np.float32)

    def _control_displacements(self, target: int) -> Doubles:
        """Return displacements of the control points by a target, (p, 3) [mm]."""
        targets, displacement = self.rig.targets, np.zeros((len(self.rig.positions_mm), 3))
        part = targets.rows(target)
        displacement[targets.point[part]] = targets.delta_mm[part]
        return displacement

    def _refine(self, values: Doubles) -> Doubles:
        """Return values at the points of the mesh (q, 3) from values at the control points (p, 3)."""
        return values if self.refinement is None else np.asarray(self.refinement @ values)


def influences(rig: Rig, refinement: csr_array | None) -> tuple[Index, Doubles]:
    """Return four bones and weights of each point of a mesh, (q, 4); weights sum to 1.

    refinement : (q, p) matrix from control points to points of the mesh, None if they are the same

    Weights of control points are kept. A refined point may follow more than four bones, and the mean of
    differently rotated points is not a rotation of their mean: the four bones and weights are chosen for the
    smallest squared distance over rotations of each bone about any axis.
    """
    skeleton = rig.skeleton
    assert skeleton is not None
    weights = _bone_weights(skeleton)
    if refinement is not None:
        weights = _fit_weights(rig.positions_mm.astype(np.float64), skeleton, weights, refinement)
    bone = np.argsort(-weights, axis=1, kind="stable")[:, :INFLUENCES]
    bone = np.pad(bone, ((0, 0), (0, INFLUENCES - bone.shape[1])))
    weight = np.take_along_axis(weights, bone, axis=1)
    weight[:, weights.shape[1] :] = 0.0
    weight /= weight.sum(axis=1, keepdims=True)
    return np.where(weight > 0, bone, 0), weight


def _bone_weights(skeleton: Skeleton) -> Doubles:
    """Return the weight of each bone at each control point, (p, b)."""
    count = len(skeleton.bone)
    weights = np.zeros((count, len(skeleton.names)))
    np.add.at(weights, (np.arange(count)[:, None], skeleton.bone), skeleton.weight)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _fit_weights(
    positions_mm: Doubles, skeleton: Skeleton, control_weights: Doubles, refinement: csr_array
) -> Doubles:
    """Return weights (q, b) of refined points with at most four bones each."""
    weights = np.asarray(refinement @ control_weights)
    weights[weights < _MIN_WEIGHT] = 0.0
    descendants = _descendants(skeleton)
    patterns, pattern = np.unique(weights > 0, axis=0, return_inverse=True)
    order = np.argsort(pattern.reshape(-1), kind="stable")
    ends = np.cumsum(np.bincount(pattern.reshape(-1), minlength=len(patterns)))
    for used, rows in zip(patterns, np.split(order, ends[:-1]), strict=True):
        interpolated = weights[rows]
        bones = np.flatnonzero(used)
        if len(bones) > 1:
            if len(bones) > _MAX_CANDIDATES:
                bones = np.sort(np.argsort(-interpolated.sum(axis=0), kind="stable")[:_MAX_CANDIDATES])
            hessian, gradient = _quadratic_error(
                positions_mm,
                skeleton,
                control_weights @ descendants.T,
                refinement[rows],
                descendants[:, bones],
            )
            hessian += _PRIOR_MM2 * np.eye(len(bones))
            weights[rows] = 0.0
            gradient += _PRIOR_MM2 * interpolated[:, bones]
            weights[rows[:, None], bones] = _best_weights(hessian, gradient)
    return weights


def _descendants(skeleton: Skeleton) -> Doubles:
    """Return a matrix (b, b) that is 1 where the second bone is the first or one of its descendants."""
    descendants = np.eye(len(skeleton.names))
    for bone, parent in enumerate(skeleton.parent.tolist()):
        if parent >= 0:
            descendants[:, bone] += descendants[:, parent]
    return descendants


def _quadratic_error(
    positions_mm: Doubles,
    skeleton: Skeleton,
    control_motion: Doubles,
    refinement: csr_array,
    descendants: Doubles,
) -> tuple[Doubles, Doubles]:
    """Return H (n, u, u) and g (n, u) of the squared error w H w - 2 g w of points by weights w [mm2].

    control_motion : (p, b) fraction of each bone's rotation that each control point follows, also by its
        descendants
    descendants : (b, u) 1 where a candidate bone is another bone or one of its descendants
    """
    points = np.asarray(refinement @ positions_mm)
    hessian = np.zeros((len(points), descendants.shape[1], descendants.shape[1]))
    gradient = np.zeros(hessian.shape[:2])
    for bone in np.flatnonzero(descendants.any(axis=1)):
        origin, moves = np.array(skeleton.origin_mm[bone]), descendants[bone]
        arm = points - origin
        target = np.asarray(refinement @ (control_motion[:, bone, None] * (positions_mm - origin)))
        hessian += (arm**2).sum(axis=1)[:, None, None] * np.outer(moves, moves)
        gradient += (arm * target).sum(axis=1)[:, None] * moves
    return hessian, gradient


def _best_weights(hessian: Doubles, gradient: Doubles) -> Doubles:
    """Return non-negative weights (n, u), at most four of them above 0, with sum 1 and the smallest error."""
    count, bones = gradient.shape
    smallest, best = np.full(count, np.inf), np.zeros(gradient.shape)
    for subset in chain.from_iterable(combinations(range(bones), k) for k in range(1, INFLUENCES + 1)):
        chosen = list(subset)
        matrix, vector = hessian[:, chosen][:, :, chosen], gradient[:, chosen]
        system = np.ones((count, len(chosen) + 1, len(chosen) + 1))
        system[:, :-1, :-1], system[:, -1, -1] = matrix, 0.0
        right = np.concatenate([vector, np.ones((count, 1))], axis=1)
        weight = np.linalg.solve(system, right[..., None])[:, :-1, 0]
        error = np.einsum("nk,nkl,nl->n", weight, matrix, weight) - 2 * (vector * weight).sum(axis=1)
        better = (weight >= 0).all(axis=1) & (error < smallest)
        smallest[better] = error[better]
        best[better] = 0.0
        best[np.flatnonzero(better)[:, None], chosen] = weight[better]
    return best
