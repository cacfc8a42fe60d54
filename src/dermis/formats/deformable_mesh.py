"""Deformation data of exported meshes: morph targets and bone weights of every vertex.

Export formats allow four bones per vertex. For a subdivided mesh, four bones and their weights
are fitted for each vertex, so that the posed vertex lies as close as possible to its position on the
subdivided surface of the posed control mesh.
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
from dermis.mesh.skeleton import BONES_PER_POINT, Skeleton
from dermis.mesh.strand_groups import root_vertices
from dermis.mesh.strands import Roots

if TYPE_CHECKING:
    from scipy.sparse import csr_array


_MIN_DISPLACEMENT_MM = 1e-3  # smaller displacements count as 0
_MIN_NORMAL_CHANGE = 2e-3  # smaller changes of unit normals count as 0: a tenth of a degree
_MIN_BONE_WEIGHT = 1e-6  # smaller weights count as 0
_MAX_CANDIDATE_BONES = 8  # bones among which four are selected
_INTERPOLATED_WEIGHTS_PENALTY_MM2 = 1.0  # penalty for the squared deviation from the interpolated weights


class VertexMorphTarget(NamedTuple):
    """Morph target of a mesh: the vertices that it changes, and their changes at weight 1.

    vertex : (n,) indices of the changed vertices
    delta_mm : (n, 3) changes of position [mm]
    normal : (n, 3) changes of the unit normal
    """

    vertex: Index
    delta_mm: Floats
    normal: Floats


@dataclass(frozen=True)
class DeformableMesh:
    """Mesh of a head for export, with morph targets and bone weights for each vertex."""

    head: Head

    @property
    def rig(self) -> Rig:
        """Return the head's rig, which acts on the control points."""
        return self.head.control_rig

    @cached_property
    def subdivision_matrix(self) -> csr_array | None:
        """Return the subdivision matrix (q, p) from control to mesh points; None without subdivision."""
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
        return (mesh.positions - self._subdivide_vectors(displacement)[mesh.point]).astype(np.float32)

    @cached_property
    def normals(self) -> Floats:
        """Return the vertex normals at `positions_mm`, (v, 3)."""
        return self._smooth_normals if self.rig.targets.rest is not None else self.head.mesh.normals

    @cached_property
    def _smooth_normals(self) -> Floats:
        mesh = self.head.mesh
        return vertex_normals(self.positions_mm, mesh.point, mesh.triangles)

    def targets(self) -> Iterator[VertexMorphTarget]:
        """Yield the morph targets in the order in which the rig lists them."""
        mesh = self.head.mesh
        for number in range(len(self.rig.targets.names)):
            delta = self._subdivide_vectors(self._control_displacements(number))
            delta[np.abs(delta).max(axis=1) < _MIN_DISPLACEMENT_MM] = 0.0
            delta_mm = delta[mesh.point].astype(np.float32)
            normal = self._normal_changes(delta_mm)
            vertex = np.flatnonzero(delta_mm.any(axis=1) | normal.any(axis=1))
            yield VertexMorphTarget(vertex, delta_mm[vertex], normal[vertex])

    def _normal_changes(self, delta_mm: Floats) -> Floats:
        """Return the changes (v, 3) of the unit normals that result from displacements of the vertices.

        delta_mm : (v, 3) displacements [mm]
        """
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
        """Return the indices and the weights of four bones for each vertex, (v, 4) each."""
        bone, weight = point_bone_influences(self.rig, self.subdivision_matrix)
        dtype = np.uint8 if bone.max() < 256 else np.uint16
        point = self.head.mesh.point
        return bone[point].astype(dtype), weight[point].astype(np.float32)

    def root_bone(self, roots: Roots) -> int:
        """Return the index of the bone that moves the roots of hairs most."""
        bone, weight = self.bone_influences
        vertex = root_vertices(self.head.mesh, roots)
        return int(np.bincount(bone[vertex].ravel(), weight[vertex].ravel()).argmax())

    def _control_displacements(self, target_index: int) -> Doubles:
        """Return the displacements (p, 3) of the control points by a morph target at weight 1 [mm]."""
        targets, displacement = self.rig.targets, np.zeros((len(self.rig.positions_mm), 3))
        part = targets.displacement_rows(target_index)
        displacement[targets.point[part]] = targets.delta_mm[part]
        return displacement

    def _subdivide_vectors(self, control_vectors: Doubles) -> Doubles:
        """Interpolate vectors at control points (p, 3) to the points of the subdivided mesh, (q, 3)."""
        return (
            control_vectors
            if self.subdivision_matrix is None
            else np.asarray(self.subdivision_matrix @ control_vectors)
        )


def point_bone_influences(rig: Rig, subdivision_matrix: csr_array | None) -> tuple[Index, Doubles]:
    """Return four bone indices and weights for each of q mesh points, (q, 4) each; weights sum to 1.

    rig : rig of the head, which moves p control points
    subdivision_matrix : (q, p) matrix from control points to mesh points; None without subdivision

    Without subdivision, the weights of the rig are kept. With subdivision, four bones and their weights are
    fitted. The fit minimises the squared distance between the skinned mesh point and the point that
    subdivision of the skinned control mesh gives, averaged over rotations of each bone about all axes.
    """
    skeleton = rig.skeleton
    assert skeleton is not None
    weights = _bone_weights(skeleton)
    if subdivision_matrix is not None:
        weights = _fit_bone_weights(
            rig.positions_mm.astype(np.float64), skeleton, weights, subdivision_matrix
        )
    bone = np.argsort(-weights, axis=1, kind="stable")[:, :BONES_PER_POINT]
    bone = np.pad(bone, ((0, 0), (0, BONES_PER_POINT - bone.shape[1])))
    weight = np.take_along_axis(weights, bone, axis=1)
    weight[:, weights.shape[1] :] = 0.0
    weight /= weight.sum(axis=1, keepdims=True)
    return np.where(weight > 0, bone, 0), weight


def _bone_weights(skeleton: Skeleton) -> Doubles:
    """Return the weight of each of b bones at each of p control points, (p, b); rows sum to 1."""
    count = len(skeleton.bone)
    weights = np.zeros((count, len(skeleton.names)))
    np.add.at(weights, (np.arange(count)[:, None], skeleton.bone), skeleton.weight)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _fit_bone_weights(
    positions_mm: Doubles, skeleton: Skeleton, control_weights: Doubles, subdivision_matrix: csr_array
) -> Doubles:
    """Return bone weights (q, b) for the points of a subdivided mesh, at most four above 0 for each point.

    positions_mm : (p, 3) positions of the control points at rest
    skeleton : the b bones
    control_weights : (p, b) bone weights of the control points
    subdivision_matrix : (q, p) subdivision matrix from control points to mesh points
    """
    weights = np.asarray(subdivision_matrix @ control_weights)
    weights[weights < _MIN_BONE_WEIGHT] = 0.0
    descendants = _descendant_matrix(skeleton)
    patterns, pattern = np.unique(weights > 0, axis=0, return_inverse=True)
    order = np.argsort(pattern.reshape(-1), kind="stable")
    ends = np.cumsum(np.bincount(pattern.reshape(-1), minlength=len(patterns)))
    for used, rows in zip(patterns, np.split(order, ends[:-1]), strict=True):
        interpolated = weights[rows]
        bones = np.flatnonzero(used)
        if len(bones) > 1:
            if len(bones) > _MAX_CANDIDATE_BONES:
                bones = np.sort(np.argsort(-interpolated.sum(axis=0), kind="stable")[:_MAX_CANDIDATE_BONES])
            hessian, gradient = _quadratic_error(
                positions_mm,
                skeleton,
                control_weights @ descendants.T,
                subdivision_matrix[rows],
                descendants[:, bones],
            )
            hessian += _INTERPOLATED_WEIGHTS_PENALTY_MM2 * np.eye(len(bones))
            weights[rows] = 0.0
            gradient += _INTERPOLATED_WEIGHTS_PENALTY_MM2 * interpolated[:, bones]
            weights[rows[:, None], bones] = _best_bone_weights(hessian, gradient)
    return weights


def _descendant_matrix(skeleton: Skeleton) -> Doubles:
    """Return a matrix (b, b): element (i, j) is 1 where bone j is bone i or a descendant of it, else 0."""
    descendants = np.eye(len(skeleton.names))
    for bone, parent in enumerate(skeleton.parent.tolist()):
        if parent >= 0:
            descendants[:, bone] += descendants[:, parent]
    return descendants


def _quadratic_error(
    positions_mm: Doubles,
    skeleton: Skeleton,
    descendant_weights: Doubles,
    subdivision_matrix: csr_array,
    descendant_matrix: Doubles,
) -> tuple[Doubles, Doubles]:
    """Return the error of n skinned points as a quadratic function of their bone weights.

    The function is w H w - 2 g w [mm²], up to a constant. The vector w (u,) contains the weights of u
    candidate bones. The result is the matrices H (n, u, u) and the vectors g (n, u) of all points.

    positions_mm : (p, 3) positions of the control points at rest
    skeleton : all b bones
    descendant_weights : (p, b) for each control point and bone, the sum of the weights of the bone and of
        its descendants
    subdivision_matrix : (n, p) subdivision matrix from control points to the n points
    descendant_matrix : (b, u) element (i, j) is 1 where candidate bone j is bone i or a descendant of it,
        else 0
    """
    points = np.asarray(subdivision_matrix @ positions_mm)
    hessian = np.zeros((len(points), descendant_matrix.shape[1], descendant_matrix.shape[1]))
    gradient = np.zeros(hessian.shape[:2])
    for bone in np.flatnonzero(descendant_matrix.any(axis=1)):
        origin, moves = np.array(skeleton.joint_positions_mm[bone]), descendant_matrix[bone]
        arm = points - origin
        target = np.asarray(
            subdivision_matrix @ (descendant_weights[:, bone, None] * (positions_mm - origin))
        )
        hessian += (arm**2).sum(axis=1)[:, None, None] * np.outer(moves, moves)
        gradient += (arm * target).sum(axis=1)[:, None] * moves
    return hessian, gradient


def _best_bone_weights(hessian: Doubles, gradient: Doubles) -> Doubles:
    """Return the weights w (n, u) that minimise w H w - 2 g w: non-negative, sum 1, at most four above 0.

    hessian : matrices H (n, u, u), see `_quadratic_error`
    gradient : vectors g (n, u), see `_quadratic_error`
    """
    count, bones = gradient.shape
    smallest, best = np.full(count, np.inf), np.zeros(gradient.shape)
    for subset in chain.from_iterable(combinations(range(bones), k) for k in range(1, BONES_PER_POINT + 1)):
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
