"""Outermost points of a shape: enough to know its extent along any direction.

Shadow maps and ranges of depth use a few points between which a head lies however it is posed. Which
these are is found once for a rig: at rest, with each of its targets alone, and in random poses; so a bound
over them is stable while the head moves, and costs next to nothing.
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

_DIRECTIONS, _FEW = 512, 256
_FINER = 64, 512, 2048  # one after the other: points beside one that is taken already are left out
_CLOSE_MM = 0.5
_MOST_CORNERS = 512
_PRODUCT = 80_000  # heights at a time
_LAYERS = 16  # points beneath the outermost ones that a pose may bring out
_POSES, _SEED = 128, 0
_TURN_DEGREES = 60.0
_MOST_BONES = 4  # that turn at once
_ACTIVE = 0.3  # share of the targets
_FOLLOWS = 0.02  # least weight


@dataclass(frozen=True, eq=False, repr=False)
class Outline(ShortRepr):
    """Places of a shape beyond which, seen from wherever, none of it lies.

    places_mm : (n, 3)
    slack_mm : how far out some of it may lie all the same; depth ranges leave so much room
    """

    places_mm: NDArray[np.floating]
    slack_mm: float = 0.0

    @cached_property
    def columns(self) -> Floats:
        """(4, n) the places as columns, each with a 1 below, for matrices from its left [mm].

        As exact as a mesh's positions, and what comes of it in each frame takes half the memory.
        """
        return np.vstack([self.places_mm.T, np.ones(len(self.places_mm))]).astype(np.float32)

    @cached_property
    def middle_mm(self) -> tuple[float, float, float]:
        """Halfway between the least and the largest coordinates [mm]."""
        x, y, z = 0.5 * (self.places_mm.min(axis=0) + self.places_mm.max(axis=0))
        return float(x), float(y), float(z)


def hull(positions: NDArray[np.floating]) -> Outline:
    """The corners of the convex hull of (n, 3) positions [mm]."""
    points = positions.astype(np.float64)
    return Outline(points[hull_points(points)])


def hull_points(positions: NDArray[np.floating]) -> Intp:
    """Numbers of the positions (n, 3) that are corners of the convex hull of all."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.sort(ConvexHull(positions.astype(np.float64)).vertices).astype(np.intp)
    except QhullError:  # it is flat
        return np.arange(len(positions))


@dataclass(frozen=True, eq=False, repr=False)
class RigOutline(ShortRepr):
    """Some of a rig's points, with all that moves them, dense; points are columns.

    rest_mm : (4, s) with a 1 below each
    delta_mm : (t, 3 s) by each target at weight 1
    weight : (b, s) of the bones that any of them follow; None without bones
    bones : (b,) the numbers of these
    """

    rest_mm: Floats
    delta_mm: Floats
    weight: Floats | None
    bones: Intp

    def posed(self, weights: Floats, matrices: Floats) -> Floats:
        """(s, 3) where they are [mm].

        weights : (t,) of the targets, beyond those at rest
        matrices : of all bones, (b, 3, 4)
        """
        columns, active = self.rest_mm, weights.nonzero()[0]
        if len(active):
            few = 2 * len(active) < len(weights)
            moved = weights[active] @ self.delta_mm[active] if few else weights @ self.delta_mm
            columns = columns.copy()
            columns[:3] += moved.reshape(3, -1)
        if self.weight is None:
            return columns[:3].T
        blended = matrices[self.bones].reshape(-1, 12).T @ self.weight
        return np.asarray((blended.reshape(3, 4, -1) * columns).sum(axis=1).T)


def outline_of(places: Floats, targets: MorphTargets, skeleton: Skeleton | None, points: Intp) -> RigOutline:
    """Some points (s,) of a rig that rests at places (p, 3) [mm]."""
    rest = np.vstack([places[points].T, np.ones(len(points), np.float32)])
    delta = targets.dense(points, len(places)).transpose(0, 2, 1).reshape(-1, 3 * len(points))
    if skeleton is None:
        return RigOutline(rest, delta, None, np.zeros(0, np.intp))
    bone, weight = skeleton.bone[points], skeleton.weight[points]
    bones, number = np.unique(bone, return_inverse=True)
    shares = np.zeros((len(bones), len(points)), np.float32)
    np.add.at(shares, (number.reshape(bone.shape), np.arange(len(points))[:, None]), weight)
    return RigOutline(rest, delta, shares, bones.astype(np.intp))


def corners_of(places: Floats) -> Intp:
    """Numbers of the corners of the convex hull of points (p, 3): all, or the outermost of too many."""
    corners = hull_points(places)
    return corners if len(corners) <= _MOST_CORNERS else corners[outermost(places[corners], _MOST_CORNERS)]


def outermost(places: Floats, count: int = _FEW) -> Intp:
    """Numbers of the points (p, 3) that lie farthest in any of some directions."""
    return np.unique(np.concatenate([height.argmax(axis=1) for height in _heights(places, count)]))


def outline_points(places: Floats, targets: MorphTargets, skeleton: Skeleton | None) -> Intp:
    """Numbers of the points of a rig that are outermost at rest, with one target, or in some pose."""
    pool = _pool(places, targets, skeleton)
    outline = outline_of(places, targets, skeleton, pool)
    still = np.zeros((0, 3, 4), np.float32) if skeleton is None else skeleton.resting
    taken = np.zeros(len(pool), bool)
    for count in _FINER:
        _take(taken, places[pool], count)
    for weights in np.eye(len(targets.names), dtype=np.float32):
        _take(taken, outline.posed(weights, still))
    rng = np.random.default_rng(_SEED)
    for _ in range(_POSES if targets.names or skeleton else 0):
        shares = rng.random(len(targets.names)) * (rng.random(len(targets.names)) < _ACTIVE)
        matrices = still if skeleton is None else _turned(skeleton, rng)
        _take(taken, outline.posed(shares.astype(np.float32), matrices))
    return pool[taken]


def _take(taken: Mask, places: Floats, count: int = _DIRECTIONS) -> None:
    """Take the points that lie farther out in one of some directions than those taken before."""
    for height in _heights(places, count):
        top = height.argmax(axis=1)
        reached = height[:, taken].max(axis=1, initial=-np.inf)
        taken[top[height[np.arange(len(top)), top] - reached > _CLOSE_MM]] = True


def _heights(places: Floats, count: int) -> Iterator[Floats]:
    """How far out points (p, 3) lie in some directions, (n, p) for a few at a time.

    A few, because a product as small as these is done by one thread: where others work, threads wait longer.
    """
    few = max(1, _PRODUCT // len(places))
    for start in range(0, count, few):
        yield _directions(count)[start : start + few] @ places.T


@lru_cache(maxsize=3)
def _directions(count: int) -> Floats:
    """(n, 3) unit vectors, even over the sphere: points of a golden spiral."""
    return np.ascontiguousarray(fibonacci_sphere(count)[:, [0, 2, 1]], np.float32)


def _pool(places: Floats, targets: MorphTargets, skeleton: Skeleton | None) -> Intp:
    """Numbers of points among which those that are outermost in any pose are looked for."""
    layers = min(_LAYERS, len(places))
    found: list[Numbers] = [outermost(places, _FINER[-1])]
    for height in _heights(places, _DIRECTIONS):
        found.append(np.argpartition(height, -layers, axis=1)[:, -layers:].ravel())
    for target in range(len(targets.names)):
        moved = targets.point[targets.of(target)]
        if len(moved):
            found.append(moved[outermost(places[moved] + targets.delta_mm[targets.of(target)])])
    if skeleton is None:
        return np.unique(np.concatenate(found))
    for bone in range(len(skeleton.names)):
        follows = ((skeleton.bone == bone) & (skeleton.weight > _FOLLOWS)).any(axis=1).nonzero()[0]
        if len(follows):
            found.append(follows[outermost(places[follows])])
    return np.unique(np.concatenate(found))


def _turned(skeleton: Skeleton, rng: np.random.Generator) -> Floats:
    """(b, 3, 4) some bones turned at random, mostly those that much follows."""
    share = skeleton.following / skeleton.following.sum()
    count = min(int(rng.integers(1, _MOST_BONES + 1)), int((share > 0).sum()))
    bones = np.sort(rng.choice(len(share), count, replace=False, p=share)).tolist()
    angles = rng.uniform(-_TURN_DEGREES, _TURN_DEGREES, (count, 3))
    rows = [skeleton.turned(bone, degrees) for bone, degrees in zip(bones, angles.tolist(), strict=True)]
    return skeleton.moved(bones, np.array(rows).reshape(-1, 4, 4))
