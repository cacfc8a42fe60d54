"""Outlines: a few points of a shape that bound the shape in every direction.

Shadow maps and depth ranges are fitted to outlines. The outline points of a rig are selected once, from the
rest pose, every morph target and random poses; posing these points gives the bounds of the head in any pose.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Floats, Intp, Mask, Numbers
from dermis.base.summary import ShortRepr
from dermis.mesh.geometry import fibonacci_sphere
from dermis.mesh.morph_targets import MorphTargets
from dermis.mesh.skeleton import Skeleton

_DIRECTION_COUNT, _COARSE_DIRECTION_COUNT = 512, 256
# few directions first, so that later passes skip points close to chosen ones
_DIRECTION_COUNTS_OF_PASSES = 64, 512, 2048
# points are skipped if they exceed the bounds of the chosen points by at most this distance
_IGNORED_EXCESS_MM = 0.5
_PROJECTIONS_PER_BLOCK = 80_000  # numbers that are computed at a time
_CANDIDATES_PER_DIRECTION = 16  # candidates per direction; any of them may be outermost in some pose
_RANDOM_POSE_COUNT, _RANDOM_POSE_SEED = 128, 0
_MAX_BONE_DEGREES = 60.0
_MAX_ROTATED_BONES = 4  # bones that are rotated in one pose
_ACTIVE_TARGET_FRACTION = 0.3  # fraction of the targets that are active in one pose
_MIN_BONE_WEIGHT = 0.02  # least weight of a bone that a point follows


@dataclass(frozen=True, eq=False, repr=False)
class Outline(ShortRepr):
    """Points that bound a shape in every direction.

    points_mm : (n, 3) positions
    margin_mm : largest distance by which the shape exceeds the bounds of these points. The ranges of depth
        that cameras and shadow maps cover are extended by this distance
    """

    points_mm: NDArray[np.floating]
    margin_mm: float = 0.0

    @cached_property
    def homogeneous_points(self) -> Floats:
        """Return the points as homogeneous columns (4, n) in float32, the precision of meshes [mm]."""
        return np.vstack([self.points_mm.T, np.ones(len(self.points_mm))]).astype(np.float32)

    @cached_property
    def centre_mm(self) -> tuple[float, float, float]:
        """Return the centre of the points' bounding box [mm]."""
        x, y, z = 0.5 * (self.points_mm.min(axis=0) + self.points_mm.max(axis=0))
        return float(x), float(y), float(z)


def convex_hull(positions: NDArray[np.floating]) -> Outline:
    """Return an outline with the corners of the convex hull of positions (n, 3) [mm]."""
    points = positions.astype(np.float64)
    return Outline(points[hull_vertices(points)])


def hull_vertices(positions: NDArray[np.floating]) -> Intp:
    """Return the indices of the positions (n, 3) that are corners of their convex hull."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.sort(ConvexHull(positions.astype(np.float64)).vertices).astype(np.intp)
    except QhullError:  # the positions lie in a plane
        return np.arange(len(positions))


@dataclass(frozen=True, eq=False, repr=False)
class RigOutline(ShortRepr):
    """Outline of a rig: points that bound its mesh in every pose, with the targets and bones that move them.

    rest_mm : (4, s) s points at rest as homogeneous columns
    delta_mm : (t, 3 s) displacements by each target at weight 1: all x, then all y, then all z
    weight : (m, s) weights of the m bones that move any of the points; None without bones
    bones : (m,) indices of these bones in the skeleton
    """

    rest_mm: Floats
    delta_mm: Floats
    weight: Floats | None
    bones: Intp

    def pose(self, target_weights: Floats, bone_matrices: Floats) -> Floats:
        """Return the outline points (s, 3) in a pose [mm].

        target_weights : (t,) weights of the targets, minus their weights in the rest pose
        bone_matrices : (b, 3, 4) matrices of all bones of the rig
        """
        columns, active = self.rest_mm, target_weights.nonzero()[0]
        if len(active):
            few = 2 * len(active) < len(target_weights)
            delta = target_weights[active] @ self.delta_mm[active] if few else target_weights @ self.delta_mm
            columns = columns.copy()
            columns[:3] += delta.reshape(3, -1)
        if self.weight is None:
            return columns[:3].T
        blended = bone_matrices[self.bones].reshape(-1, 12).T @ self.weight
        return np.asarray((blended.reshape(3, 4, -1) * columns).sum(axis=1).T)


def rig_outline(
    positions: Floats, targets: MorphTargets, skeleton: Skeleton | None, outline_points: Intp
) -> RigOutline:
    """Return a `RigOutline` of selected points of a rig.

    positions : (p, 3) positions of all control points at rest [mm]
    outline_points : (s,) indices of the outline points
    """
    rest = np.vstack([positions[outline_points].T, np.ones(len(outline_points), np.float32)])
    delta = (
        targets.dense_displacements(outline_points, len(positions))
        .transpose(0, 2, 1)
        .reshape(-1, 3 * len(outline_points))
    )
    if skeleton is None:
        return RigOutline(rest, delta, None, np.zeros(0, np.intp))
    bone, weight = skeleton.bone[outline_points], skeleton.weight[outline_points]
    bones, row = np.unique(bone, return_inverse=True)
    weights = np.zeros((len(bones), len(outline_points)), np.float32)
    np.add.at(weights, (row.reshape(bone.shape), np.arange(len(outline_points))[:, None]), weight)
    return RigOutline(rest, delta, weights, bones.astype(np.intp))


def extreme_points(positions: Floats, direction_count: int = _COARSE_DIRECTION_COUNT) -> Intp:
    """Return the indices of the points (p, 3) that are farthest in one of `direction_count` directions."""
    return np.unique(
        np.concatenate(
            [height.argmax(axis=1) for height in _project_on_directions(positions, direction_count)]
        )
    )


def find_outline_points(positions: Floats, targets: MorphTargets, skeleton: Skeleton | None) -> Intp:
    """Return the indices of a rig's points that are outermost in some direction in some pose.

    The poses are the rest pose, each morph target alone, and random poses.

    positions : (p, 3) positions of all control points at rest [mm]
    """
    candidates = _outline_candidates(positions, targets, skeleton)
    outline = rig_outline(positions, targets, skeleton, candidates)
    rest = np.zeros((0, 3, 4), np.float32) if skeleton is None else skeleton.rest_matrices
    chosen = np.zeros(len(candidates), bool)
    for count in _DIRECTION_COUNTS_OF_PASSES:
        _select_extreme_points(chosen, positions[candidates], count)
    for weights in np.eye(len(targets.names), dtype=np.float32):
        _select_extreme_points(chosen, outline.pose(weights, rest))
    rng = np.random.default_rng(_RANDOM_POSE_SEED)
    for _ in range(_RANDOM_POSE_COUNT if targets.names or skeleton else 0):
        random_weights = rng.random(len(targets.names)) * (
            rng.random(len(targets.names)) < _ACTIVE_TARGET_FRACTION
        )
        matrices = rest if skeleton is None else _random_bone_matrices(skeleton, rng)
        _select_extreme_points(chosen, outline.pose(random_weights.astype(np.float32), matrices))
    return candidates[chosen]


def _select_extreme_points(
    selected_points: Mask, positions: Floats, direction_count: int = _DIRECTION_COUNT
) -> None:
    """Select more points: those that exceed the bounds of the selected points in some direction.

    selected_points : (p,) mask of the selected points, which this function extends
    positions : (p, 3) positions of all points
    """
    for height in _project_on_directions(positions, direction_count):
        top = height.argmax(axis=1)
        reached = height[:, selected_points].max(axis=1, initial=-np.inf)
        selected_points[top[height[np.arange(len(top)), top] - reached > _IGNORED_EXCESS_MM]] = True


def _project_on_directions(positions: Floats, direction_count: int) -> Iterator[Floats]:
    """Yield the projections (n, p) of points (p, 3) on unit vectors, in blocks of n directions.

    The blocks are small, so that NumPy multiplies each of them on a single thread.

    direction_count : total number of directions
    """
    block = max(1, _PROJECTIONS_PER_BLOCK // len(positions))
    for start in range(0, direction_count, block):
        yield _sphere_directions(direction_count)[start : start + block] @ positions.T


@lru_cache(maxsize=3)
def _sphere_directions(direction_count: int) -> Floats:
    """Return unit vectors (direction_count, 3) distributed evenly over the sphere."""
    return np.ascontiguousarray(fibonacci_sphere(direction_count)[:, [0, 2, 1]], np.float32)


def _outline_candidates(positions: Floats, targets: MorphTargets, skeleton: Skeleton | None) -> Intp:
    """Return the indices of the points among which `find_outline_points` searches."""
    layers = min(_CANDIDATES_PER_DIRECTION, len(positions))
    found: list[Numbers] = [extreme_points(positions, _DIRECTION_COUNTS_OF_PASSES[-1])]
    for height in _project_on_directions(positions, _DIRECTION_COUNT):
        found.append(np.argpartition(height, -layers, axis=1)[:, -layers:].ravel())
    for target in range(len(targets.names)):
        rows = targets.displacement_rows(target)
        displaced = targets.point[rows]
        if len(displaced):
            found.append(displaced[extreme_points(positions[displaced] + targets.delta_mm[rows])])
    if skeleton is None:
        return np.unique(np.concatenate(found))
    for bone in range(len(skeleton.names)):
        followers = ((skeleton.bone == bone) & (skeleton.weight > _MIN_BONE_WEIGHT)).any(axis=1).nonzero()[0]
        if len(followers):
            found.append(followers[extreme_points(positions[followers])])
    return np.unique(np.concatenate(found))


def _random_bone_matrices(skeleton: Skeleton, rng: np.random.Generator) -> Floats:
    """Return bone matrices (b, 3, 4) for random rotations of a few bones.

    The more points follow a bone or its descendants, the more likely the bone is chosen.
    """
    probability = skeleton.subtree_weight_sums / skeleton.subtree_weight_sums.sum()
    count = min(int(rng.integers(1, _MAX_ROTATED_BONES + 1)), int((probability > 0).sum()))
    bones = np.sort(rng.choice(len(probability), count, replace=False, p=probability)).tolist()
    angles = rng.uniform(-_MAX_BONE_DEGREES, _MAX_BONE_DEGREES, (count, 3))
    rows = [skeleton.joint_rotation_matrix(*pair) for pair in zip(bones, angles.tolist(), strict=True)]
    return skeleton.pose_matrices(bones, np.array(rows).reshape(-1, 4, 4))
