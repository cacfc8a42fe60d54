"""What moves a mesh that is written: morph targets and bones of its control points, carried to finer ones.

Other programs take four bones for each point. For a finer mesh they are chosen so that turns take its points
where those of its control points take them.
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


_MIN_DISPLACEMENT_MM = 1e-3  # a smaller displacement is none
_MIN_NORMAL_CHANGE = 2e-3  # of a normal, a tenth of a degree
_MIN_WEIGHT = 1e-6  # a share below it is none
_MAX_CANDIDATES = 8  # bones among which four are chosen
_PRIOR_MM2 = 1.0  # how much a share is worth that stays as the control points have it


class VertexTarget(NamedTuple):
    """Vertices that a morph target moves, by how much at weight 1, and what that adds to their normals.

    vertex : (n,)
    delta_mm, normal : (n, 3)
    """

    vertex: Index
    delta_mm: Floats
    normal: Floats


@dataclass(frozen=True)
class DeformableMesh:
    """The vertices of a head's mesh, and what moves them."""

    head: Head

    @property
    def rig(self) -> Rig:
        """Of the control points."""
        return self.head.control

    @cached_property
    def refinement(self) -> csr_array | None:
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
            control += weight * self._control_displacements(number)
        return (mesh.positions - self._refine(control)[mesh.point]).astype(np.float32)

    @cached_property
    def normals(self) -> Floats:
        """(v, 3) normals there."""
        return self._smooth_normals if self.rig.targets.rest is not None else self.head.mesh.normals

    @cached_property
    def _smooth_normals(self) -> Floats:
        mesh = self.head.mesh
        return vertex_normals(self.positions_mm, mesh.point, mesh.triangles)

    def targets(self) -> Iterator[VertexTarget]:
        """Each of the morph targets."""
        mesh = self.head.mesh
        for number in range(len(self.rig.targets.names)):
            delta = self._refine(self._control_displacements(number))
            delta[np.abs(delta).max(axis=1) < _MIN_DISPLACEMENT_MM] = 0.0
            moved = delta[mesh.point].astype(np.float32)
            turned = self._normal_changes(moved)
            vertex = np.flatnonzero(moved.any(axis=1) | turned.any(axis=1))
            yield VertexTarget(vertex, moved[vertex], turned[vertex])

    def _normal_changes(self, moved: Floats) -> Floats:
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
        found[vertex] = vertex_normals(places, point, triangles) - self._smooth_normals[vertex]
        found[~touched[mesh.point] | (np.abs(found).max(axis=1) < _MIN_NORMAL_CHANGE)] = 0.0
        return found

    @cached_property
    def bone_influences(self) -> tuple[Numbers, Floats]:
        """(v, 4) bones that each vertex follows, and by what share."""
        bone, share = influences(self.rig, self.refinement)
        kind = np.uint8 if bone.max() < 256 else np.uint16
        point = self.head.mesh.point
        return bone[point].astype(kind), share[point].astype(np.float32)

    def _control_displacements(self, target: int) -> Doubles:
        """(p, 3) displacements of the control points."""
        targets, found = self.rig.targets, np.zeros((len(self.rig.positions_mm), 3))
        part = targets.of(target)
        found[targets.point[part]] = targets.delta_mm[part]
        return found

    def _refine(self, control: Doubles) -> Doubles:
        """(q, 3) of the points of the mesh."""
        return control if self.refinement is None else np.asarray(self.refinement @ control)


if TYPE_CHECKING:
    from scipy.sparse import csr_array


def influences(rig: Rig, finer: csr_array | None) -> tuple[Index, Doubles]:
    """(q, 4) bones and shares of the points of a mesh; the shares of a point add up to 1.

    finer : (q, p) weights of the control points, None where the mesh has them as they are

    A control point's own are kept. A mean of points that turn differently is no turn of their mean, and may
    follow more than four bones: of all choices that one is taken which comes nearest, by least squares over a
    turn of each bone about any axis.
    """
    skeleton = rig.skeleton
    assert skeleton is not None
    shares = _bone_weights(skeleton)
    if finer is not None:
        shares = _fit_weights(rig.positions_mm.astype(np.float64), skeleton, shares, finer)
    bone = np.argsort(-shares, axis=1, kind="stable")[:, :INFLUENCES]
    bone = np.pad(bone, ((0, 0), (0, INFLUENCES - bone.shape[1])))
    weight = np.take_along_axis(shares, bone, axis=1)
    weight[:, shares.shape[1] :] = 0.0
    weight /= weight.sum(axis=1, keepdims=True)
    return np.where(weight > 0, bone, 0), weight


def _bone_weights(skeleton: Skeleton) -> Doubles:
    """(p, b) of each bone at each control point."""
    count = len(skeleton.bone)
    shares = np.zeros((count, len(skeleton.names)))
    np.add.at(shares, (np.arange(count)[:, None], skeleton.bone), skeleton.weight)
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))


def _fit_weights(places_mm: Doubles, skeleton: Skeleton, control: Doubles, finer: csr_array) -> Doubles:
    """(q, b) with at most four shares in a row."""
    shares = np.asarray(finer @ control)
    shares[shares < _MIN_WEIGHT] = 0.0
    below = _descendants(skeleton)
    kinds, kind = np.unique(shares > 0, axis=0, return_inverse=True)
    order = np.argsort(kind.reshape(-1), kind="stable")
    ends = np.cumsum(np.bincount(kind.reshape(-1), minlength=len(kinds)))
    for used, rows in zip(kinds, np.split(order, ends[:-1]), strict=True):
        mean = shares[rows]
        bones = np.flatnonzero(used)
        if len(bones) > 1:
            if len(bones) > _MAX_CANDIDATES:
                bones = np.sort(np.argsort(-mean.sum(axis=0), kind="stable")[:_MAX_CANDIDATES])
            hessian, slope = _quadratic_error(
                places_mm, skeleton, control @ below.T, finer[rows], below[:, bones]
            )
            hessian += _PRIOR_MM2 * np.eye(len(bones))
            shares[rows] = 0.0
            shares[rows[:, None], bones] = _best_weights(hessian, slope + _PRIOR_MM2 * mean[:, bones])
    return shares


def _descendants(skeleton: Skeleton) -> Doubles:
    """(b, b) 1 where the second bone is the first, or below it."""
    below = np.eye(len(skeleton.names))
    for bone, parent in enumerate(skeleton.parent.tolist()):
        if parent >= 0:
            below[:, bone] += below[:, parent]
    return below


def _quadratic_error(
    places_mm: Doubles, skeleton: Skeleton, follow: Doubles, finer: csr_array, below: Doubles
) -> tuple[Doubles, Doubles]:
    """How far points miss, as w H w - 2 g w of their shares w [mm2]: H (n, u, u) and g (n, u).

    follow : (p, b) how much of each bone's turn takes each control point, by bones below too
    below : (b, u) 1 where a bone among which is chosen is another one, or below it
    """
    points = np.asarray(finer @ places_mm)
    hessian = np.zeros((len(points), below.shape[1], below.shape[1]))
    slope = np.zeros(hessian.shape[:2])
    for bone in np.flatnonzero(below.any(axis=1)):
        origin, moved = np.array(skeleton.origin_mm[bone]), below[bone]
        arm = points - origin
        meant = np.asarray(finer @ (follow[:, bone, None] * (places_mm - origin)))
        hessian += (arm**2).sum(axis=1)[:, None, None] * np.outer(moved, moved)
        slope += (arm * meant).sum(axis=1)[:, None] * moved
    return hessian, slope


def _best_weights(hessian: Doubles, slope: Doubles) -> Doubles:
    """(n, u) shares of 0 and more, at most four of them not 0, that add up to 1 and miss least."""
    count, bones = slope.shape
    best, found = np.full(count, np.inf), np.zeros(slope.shape)
    for some in chain.from_iterable(combinations(range(bones), k) for k in range(1, INFLUENCES + 1)):
        chosen = list(some)
        part, side = hessian[:, chosen][:, :, chosen], slope[:, chosen]
        system = np.ones((count, len(chosen) + 1, len(chosen) + 1))
        system[:, :-1, :-1], system[:, -1, -1] = part, 0.0
        right = np.concatenate([side, np.ones((count, 1))], axis=1)
        weight = np.linalg.solve(system, right[..., None])[:, :-1, 0]
        missed = np.einsum("nk,nkl,nl->n", weight, part, weight) - 2 * (side * weight).sum(axis=1)
        better = (weight >= 0).all(axis=1) & (missed < best)
        best[better] = missed[better]
        found[better] = 0.0
        found[np.flatnonzero(better)[:, None], chosen] = weight[better]
    return found
