"""Outlines: the few points of a shape that bound it in every direction.

Shadow maps and depth ranges are fitted to these points. For a rig they are found once, from the rest pose,
each morph target and random poses, so that its bounds in any pose follow from few points.
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

_DIRECTIONS, _FEW_DIRECTIONS = 512, 256
_REFINED_DIRECTIONS = 64, 512, 2048  # in this order, so that points close to chosen ones are skipped
_CLOSE_MM = 0.5
_MAX_CORNERS = 512
_BLOCK = 80_000  # numbers that are computed at a time
_LAYERS = 16  # candidates per direction, of which a pose may bring another one outermost
_POSES, _SEED = 128, 0
_MAX_DEGREES = 60.0
_MAX_BONES = 4  # that are rotated in one pose
_ACTIVE_TARGETS = 0.3  # fraction of the targets in one pose
_MIN_WEIGHT = 0.02  # of a bone for a point to follow it


@dataclass(frozen=True, eq=False, repr=False)
class Outline(ShortRepr):
    """Points that bound a shape in every direction.

    points_mm : (n, 3)
    margin_mm : largest distance of the shape beyond the bounds of these points, which depth ranges add
    """

    points_mm: NDArray[np.floating]
    margin_mm: float = 0.0

    @cached_property
    def homogeneous(self) -> Floats:
        """Return the points as homogeneous columns (4, n), in single precision like meshes [mm]."""
        return np.vstack([self.points_mm.T, np.ones(len(self.points_mm))]).astype(np.float32)

    @cached_property
    def centre_mm(self) -> tuple[float, float, float]:
        """Return the centre of the bounding box [mm]."""
        x, y, z = 0.5 * (self.points_mm.min(axis=0) + self.points_mm.max(axis=0))
        return float(x), float(y), float(z)


def convex_hull(positions: NDArray[np.floating]) -> Outline:
    """Return the corners of the convex hull of (n, 3) positions [mm]."""
    points = positions.astype(np.float64)
    return Outline(points[hull_vertices(points)])


def hull_vertices(positions: NDArray[np.floating]) -> Intp:
    """Return the indices of the positions (n, 3) that are corners of their convex hull."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.sort(ConvexHull(positions.astype(np.float64)).vertices).astype(np.intp)
    except QhullError:  # it is flat
        return np.arange(len(positions))


@dataclass(frozen=True, eq=False, repr=False)
class RigOutline(ShortRepr):
    """Some points of a rig with dense morph targets and skin weights; points are columns.

    rest_mm : (4, s) homogeneous points at rest
    delta_mm : (t, 3 s) displacements by each target at weight 1
    weight : (b, s) weights of the bones that move any of the points; None without bones
    bones : (b,) indices of these bones
    """

    rest_mm: Floats
    delta_mm: Floats
    weight: Floats | None
    bones: Intp

    def pose(self, weights: Floats, matrices: Floats) -> Floats:
        """Return the points (s, 3) in a pose [mm].

        weights : (t,) of the targets, relative to the rest pose
        matrices : (b, 3, 4) of all bones of the rig
        """
        columns, active = self.rest_mm, weights.nonzero()[0]
        if len(active):
            few = 2 * len(active) < len(weights)
            delta = weights[active] @ self.delta_mm[active] if few else weights @ self.delta_mm
            columns = columns.copy()
            columns[:3] += delta.reshape(3, -1)
        if self.weight is None:
            return columns[:3].T
        blended = matrices[self.bones].reshape(-1, 12).T @ self.weight
        return np.asarray((blended.reshape(3, 4, -1) * columns).sum(axis=1).T)


def rig_outline(
    positions: Floats, targets: MorphTargets, skeleton: Skeleton | None, points: Intp
) -> RigOutline:
    """Return some points (s,) of a rig with what moves them.

    positions : (p, 3) of all points at rest [mm]
    """
    rest = np.vstack([positions[points].T, np.ones(len(points), np.float32)])
    delta = targets.dense(points, len(positions)).transpose(0, 2, 1).reshape(-1, 3 * len(points))
    if skeleton is None:
        return RigOutline(rest, delta, None, np.zeros(0, np.intp))
    bone, weight = skeleton.bone[points], skeleton.weight[points]
    bones, number = np.unique(bone, return_inverse=True)
    weights = np.zeros((len(bones), len(points)), np.float32)
    np.add.at(weights, (number.reshape(bone.shape), np.arange(len(points))[:, None]), weight)
    return RigOutline(rest, delta, weights, bones.astype(np.intp))


def hull_corners(positions: Floats) -> Intp:
    """Return the indices of corners of the convex hull of points (p, 3), the extreme ones if too many."""
    corners = hull_vertices(positions)
    few = len(corners) <= _MAX_CORNERS
    return corners if few else corners[extreme_points(positions[corners], _MAX_CORNERS)]


def extreme_points(positions: Floats, count: int = _FEW_DIRECTIONS) -> Intp:
    """Return the indices of the points (p, 3) that are farthest in any of `count` directions."""
    return np.unique(np.concatenate([height.argmax(axis=1) for height in _heights(positions, count)]))


def find_outline_points(positions: Floats, targets: MorphTargets, skeleton: Skeleton | None) -> Intp:
    """Return the indices of a rig's points that are extreme at rest, with one target, or in a random pose."""
    candidates = _candidates(positions, targets, skeleton)
    outline = rig_outline(positions, targets, skeleton, candidates)
    rest = np.zeros((0, 3, 4), np.float32) if skeleton is None else skeleton.rest_matrices
    chosen = np.zeros(len(candidates), bool)
    for count in _REFINED_DIRECTIONS:
        _add_extreme(chosen, positions[candidates], count)
    for weights in np.eye(len(targets.names), dtype=np.float32):
        _add_extreme(chosen, outline.pose(weights, rest))
    rng = np.random.default_rng(_SEED)
    for _ in range(_POSES if targets.names or skeleton else 0):
        random_weights = rng.random(len(targets.names)) * (rng.random(len(targets.names)) < _ACTIVE_TARGETS)
        matrices = rest if skeleton is None else _random_pose(skeleton, rng)
        _add_extreme(chosen, outline.pose(random_weights.astype(np.float32), matrices))
    return candidates[chosen]


def _add_extreme(chosen: Mask, positions: Floats, count: int = _DIRECTIONS) -> None:
    """Mark points as chosen that are farther in one of the directions than those chosen before."""
    for height in _heights(positions, count):
        top = height.argmax(axis=1)
        reached = height[:, chosen].max(axis=1, initial=-np.inf)
        chosen[top[height[np.arange(len(top)), top] - reached > _CLOSE_MM]] = True


def _heights(positions: Floats, count: int) -> Iterator[Floats]:
    """Yield the distances of points (p, 3) along directions, (n, p) for a few of these at a time.

    Products of this size are computed by one thread; larger ones wait for others where all cores are busy.
    """
    block = max(1, _BLOCK // len(positions))
    for start in range(0, count, block):
        yield _directions(count)[start : start + block] @ positions.T


@lru_cache(maxsize=3)
def _directions(count: int) -> Floats:
    """Return (n, 3) unit vectors that are evenly distributed over the sphere, on a golden spiral."""
    return np.ascontiguousarray(fibonacci_sphere(count)[:, [0, 2, 1]], np.float32)


def _candidates(positions: Floats, targets: MorphTargets, skeleton: Skeleton | None) -> Intp:
    """Return the indices of points that may be extreme in some pose."""
    layers = min(_LAYERS, len(positions))
    found: list[Numbers] = [extreme_points(positions, _REFINED_DIRECTIONS[-1])]
    for height in _heights(positions, _DIRECTIONS):
        found.append(np.argpartition(height, -layers, axis=1)[:, -layers:].ravel())
    for target in range(len(targets.names)):
        rows = targets.rows(target)
        displaced = targets.point[rows]
        if len(displaced):
            found.append(displaced[extreme_points(positions[displaced] + targets.delta_mm[rows])])
    if skeleton is None:
        return np.unique(np.concatenate(found))
    for bone in range(len(skeleton.names)):
        followers = ((skeleton.bone == bone) & (skeleton.weight > _MIN_WEIGHT)).any(axis=1).nonzero()[0]
        if len(followers):
            found.append(followers[extreme_points(positions[followers])])
    return np.unique(np.concatenate(found))


def _random_pose(skeleton: Skeleton, rng: np.random.Generator) -> Floats:
    """Return the matrices (b, 3, 4) for random rotations of some bones, chosen by their followers."""
    probability = skeleton.follower_counts / skeleton.follower_counts.sum()
    count = min(int(rng.integers(1, _MAX_BONES + 1)), int((probability > 0).sum()))
    bones = np.sort(rng.choice(len(probability), count, replace=False, p=probability)).tolist()
    angles = rng.uniform(-_MAX_DEGREES, _MAX_DEGREES, (count, 3))
    rows = [skeleton.bone_rotation(*pair) for pair in zip(bones, angles.tolist(), strict=True)]
    return skeleton.moved_matrices(bones, np.array(rows).reshape(-1, 4, 4))
