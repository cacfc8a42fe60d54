"""Rigs, which move the control points of a head by morph targets and bones."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Floats, Intp, Ints, Mask, Numbers
from dermis.base.disk import cached_array
from dermis.base.summary import ShortRepr
from dermis.mesh.eyeball import LidContact
from dermis.mesh.morph_targets import MorphTargets, no_targets
from dermis.mesh.outline import RigOutline, extreme_points, find_outline_points, rig_outline
from dermis.mesh.rotations import rigid_motion
from dermis.mesh.skeleton import BONES_PER_POINT, Skeleton

__all__ = [
    "BONES_PER_POINT",
    "BoneRotation",
    "MorphTargets",
    "PoseArrays",
    "Rig",
    "RigidFollowers",
    "Skeleton",
    "Stencils",
    "no_targets",
]

_CACHE_VERSION = "outline 6"  # change it when the search returns other points


class PoseArrays(NamedTuple):
    """Pose of a rig as arrays for the GPU.

    weights : (t,) weights of the targets, minus their weights in the rest pose
    matrices : (b, 3, 4) bone matrices, which transform points at rest [mm]
    positions_mm : (p, 3) points at rest
    """

    weights: Floats
    matrices: Floats
    positions_mm: Floats


@dataclass(frozen=True, eq=False, repr=False)
class Stencils(ShortRepr):
    """Points of a subdivided mesh as weighted means of control points, in compressed rows.

    first : (q + 1,) index at which the control points of each mesh point start in `point` and `weight`; the
        last element is n
    point : (n,) indices of control points
    weight : (n,) weights of these control points, which sum to 1 for each mesh point
    """

    first: Ints
    point: Ints
    weight: Floats

    def points(self, control_mm: Doubles) -> Doubles:
        """Return the points of the subdivided mesh (q, 3) from control points (p, 3) [mm]."""
        weighted = self.weight[:, None] * control_mm[self.point]
        return np.asarray(np.add.reduceat(weighted, self.first[:-1], axis=0))


class BoneRotation(NamedTuple):
    """Rotation of a bone by a morph target, in addition to the target's displacements.

    target, bone : names of the target and of the bone
    degrees : angles about the head's x, y and z at weight 1
    """

    target: str
    bone: str
    degrees: tuple[float, float, float]


class RigidFollowers(NamedTuple):
    """Points that follow other points as one rigid body, such as the points of a fitted eyeball.

    leaders : (n,) indices of the points that are followed; all of them come from the mesh file
    points : (m,) indices of the points that follow the leaders; dermis added them, they are not in the file
    """

    leaders: Ints
    points: Ints


class _SurfaceCurve(NamedTuple):
    """Curve on a subdivided surface as weighted means of control points.

    points : (n,) indices of the control points around the curve
    weights : (e, n) weights of these control points in the e points of the curve
    outline : these control points in a form that can be posed
    """

    points: Intp
    weights: Doubles
    outline: RigOutline

    def posed_mm(self, pose_arrays: PoseArrays) -> Doubles:
        """Return the points of the curve (e, 3) in a pose [mm]."""
        rest = np.vstack([pose_arrays.positions_mm[self.points].T, self.outline.rest_mm[3]])
        posed = replace(self.outline, rest_mm=rest).pose(pose_arrays.weights, pose_arrays.matrices)
        return np.asarray(self.weights @ posed)


@dataclass(frozen=True, eq=False, repr=False)
class Rig(ShortRepr):
    """Control points of a head, moved by morph targets first and then by bones.

    positions_mm : (p, 3) control points at rest, in head space
    targets, skeleton : morph targets and bones; `skeleton` is None without bones
    stencils : subdivision from control points to mesh points; None without subdivision
    bone_rotations : rotations of bones by morph targets
    rigid_followers : points that dermis added, such as the points of fitted eyeballs, and the points of the
        file that they follow
    contact : lids that must stay outside the eyeballs; None if lids may intersect eyeballs
    mouth_edge : (r + 1,) control points along the edge of the lips, once around the opening of the mouth, and
        then one on the biting edge of the upper incisors; None if they are unknown
    template : rig with corresponding points, targets and bones, from which this rig takes the points of its
        `outline`, to avoid a search for its own; None if there is no such rig
    """

    positions_mm: Floats
    targets: MorphTargets = field(default_factory=no_targets)
    skeleton: Skeleton | None = None
    stencils: Stencils | None = None
    bone_rotations: tuple[BoneRotation, ...] = ()
    rigid_followers: tuple[RigidFollowers, ...] = ()
    contact: LidContact | None = None
    mouth_edge: Ints | None = None
    template: Rig | None = None

    @cached_property
    def rest(self) -> PoseArrays:
        """Return the rest pose as arrays."""
        bones = np.zeros((0, 3, 4), np.float32) if self.skeleton is None else self.skeleton.rest_matrices
        return PoseArrays(np.zeros(len(self.targets.names), np.float32), bones, self.positions_mm)

    @property
    def file_point_count(self) -> int:
        """Return the number of control points from the file, which precede all other control points."""
        return len(self.positions_mm) - sum(len(one.points) for one in self.rigid_followers)

    def complete_positions(self, file_positions_mm: Floats) -> Floats:
        """Return the rest positions of all control points (p, 3), from positions of the file's points [mm].

        Rigid followers, such as fitted eyeballs, move with the file's points that they follow.
        """
        positions = np.concatenate([file_positions_mm, self.positions_mm[len(file_positions_mm) :]])
        for leaders, points in self.rigid_followers:
            before, after = self.positions_mm[leaders], file_positions_mm[leaders]
            matrix, shift = rigid_motion(before.astype(np.float64), after.astype(np.float64))
            positions[points] = self.positions_mm[points] @ matrix.T + shift
        return positions

    @property
    def target_index(self) -> dict[str, int]:
        """Return a dictionary from the name of each target to its index."""
        return self.targets.index_by_name

    @cached_property
    def outline(self) -> RigOutline:
        """Return points that bound the mesh in every pose, with the targets and bones that move them.

        They are the control points that are outermost in some direction in some pose. The search for them is
        done once and cached on disk.
        """
        return rig_outline(self.positions_mm, self.targets, self.skeleton, self._outline_points)

    def outline_mm(self, pose_arrays: PoseArrays) -> Floats:
        """Return points (s, 3) whose convex hull contains the posed head, to about a millimetre [mm].

        If `pose_arrays` replaces the rest positions, the extreme points of the new positions are added.
        """
        if pose_arrays.positions_mm is self.positions_mm:
            return self.outline.pose(pose_arrays.weights, pose_arrays.matrices)
        return self._outline_for(pose_arrays.positions_mm).pose(pose_arrays.weights, pose_arrays.matrices)

    def _outline_for(self, rest_positions: Floats) -> RigOutline:
        """Return the points that bound the mesh in every pose, after a change of the rest positions.

        The last result is cached. It is returned again if its points have the same rest positions.

        rest_positions : (p, 3) rest positions of all control points [mm]
        """
        points, outline = self._last_outline
        if not np.array_equal(rest_positions[points].T, outline.rest_mm[:3]):
            points = np.union1d(self._outline_points, extreme_points(rest_positions))
            outline = rig_outline(rest_positions, self.targets, self.skeleton, points)
            vars(self)["_last_outline"] = points, outline
        return outline

    @cached_property
    def _last_outline(self) -> tuple[Intp, RigOutline]:
        return self._outline_points, self.outline

    @cached_property
    def _outline_points(self) -> Intp:
        if self.template is not None:
            return np.union1d(self.template._outline_points, extreme_points(self.positions_mm))
        targets, skeleton = self.targets, self.skeleton
        sources: list[Numbers] = [self.positions_mm, targets.first, targets.point, targets.delta_mm]
        if skeleton is not None:
            sources += [skeleton.parent, skeleton.local, skeleton.to_head, skeleton.bone, skeleton.weight]
        return cached_array(
            sources, _CACHE_VERSION, lambda: find_outline_points(self.positions_mm, targets, skeleton)
        ).astype(np.intp)

    def posed_points_mm(self, pose_arrays: PoseArrays) -> Doubles:
        """Return the points (q, 3) of the mesh in a pose, after any subdivision [mm]."""
        rig = replace(self, positions_mm=pose_arrays.positions_mm)
        control = rig.pose(pose_arrays.weights.astype(np.float64), pose_arrays.matrices.astype(np.float64))
        return control if self.stencils is None else self.stencils.points(control)

    def lid_edges_mm(self, pose_arrays: PoseArrays) -> Doubles:
        """Return points (k, r, 3) along the lid edges in a pose, on the subdivided surface [mm].

        There are k eyes with r points around each opening, see `LidContact.edge`.
        """
        assert self.contact is not None
        return self._lid_edges.posed_mm(pose_arrays).reshape(*self.contact.edge.shape, 3)

    def mouth_edge_mm(self, pose_arrays: PoseArrays) -> Doubles:
        """Return the points (r + 1, 3) of `mouth_edge` in a pose, on the subdivided surface [mm]."""
        return self._mouth_edge.posed_mm(pose_arrays)

    @cached_property
    def _lid_edges(self) -> _SurfaceCurve:
        assert self.contact is not None
        return self._surface_curve(self.contact.edge)

    @cached_property
    def _mouth_edge(self) -> _SurfaceCurve:
        assert self.mouth_edge is not None
        return self._surface_curve(self.mouth_edge)

    def _surface_curve(self, edge_points: Ints) -> _SurfaceCurve:
        """Return a curve on the subdivided surface that follows control points, in any pose.

        edge_points : indices of the control points, of any shape
        """
        edge = edge_points.ravel().astype(np.intp)
        points, weights = edge, np.eye(len(edge))
        if self.stencils is not None:  # whose first points are the control points on the surface
            parts = [slice(*self.stencils.first[one : one + 2]) for one in edge]
            points = np.unique(np.concatenate([self.stencils.point[part] for part in parts])).astype(np.intp)
            weights = np.zeros((len(edge), len(points)))
            for row, part in zip(weights, parts, strict=True):
                row[np.searchsorted(points, self.stencils.point[part])] = self.stencils.weight[part]
        outline = rig_outline(self.positions_mm, self.targets, self.skeleton, points)
        return _SurfaceCurve(points, weights, outline)

    def pose_points(self, points: Ints, pose_arrays: PoseArrays) -> Doubles:
        """Return selected control points (n, 3) in a pose [mm].

        points : (n,) indices of the control points
        """
        positions = pose_arrays.positions_mm[points].astype(np.float64)
        if self._target_moved_mask[points].any():
            positions += np.einsum("t,tpk->pk", pose_arrays.weights, self._dense_displacements(points))
        if self.skeleton is None:
            return positions
        homogeneous = np.concatenate([positions, np.ones((len(positions), 1))], axis=1)
        weight, matrices = self.skeleton.weight[points], pose_arrays.matrices[self.skeleton.bone[points]]
        return np.asarray(np.einsum("pk,pkij,pj->pi", weight, matrices, homogeneous))

    @cached_property
    def _target_moved_mask(self) -> Mask:
        """Return a mask (p,) of the control points that some morph target moves."""
        displaced = np.zeros(len(self.positions_mm), bool)
        displaced[self.targets.point] = True
        return displaced

    def _dense_displacements(self, points: Ints) -> Floats:
        """Return the displacements (t, n, 3) of n control points by all targets; cache the last result."""
        last_points, dense = vars(self).get("_last", (None, None))
        if dense is None or not np.array_equal(last_points, points):
            dense = self.targets.dense_displacements(points.astype(np.intp), len(self.positions_mm))
            vars(self)["_last"] = points, dense
        return np.asarray(dense)

    def pose(self, target_weights: Doubles, bone_matrices: Doubles | None = None) -> Doubles:
        """Return all control points (p, 3) in a pose, computed on the CPU [mm].

        target_weights : (t,) weights of the targets, minus their weights in the rest pose
        bone_matrices : (b, 3, 4) matrices of the bones, from `Skeleton.matrices`; None for the rest pose
        """
        targets, points = self.targets, self.positions_mm.astype(np.float64)
        row_weights = np.repeat(target_weights, np.diff(targets.first))
        np.add.at(points, targets.point, row_weights[:, None] * targets.delta_mm)
        if self.skeleton is not None and bone_matrices is not None:
            homogeneous = np.concatenate([points, np.ones((len(points), 1))], axis=1)
            blended = np.einsum("pk,pkij->pij", self.skeleton.weight, bone_matrices[self.skeleton.bone])
            points = np.asarray(np.einsum("pij,pj->pi", blended, homogeneous))
        return points if self.contact is None else self.contact.push_out(points)
