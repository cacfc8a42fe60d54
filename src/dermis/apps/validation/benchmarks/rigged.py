"""A head with many morph targets and some bones, all of which move in each frame."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.mesh.rig import MorphTargets, Skeleton

BONES = 4
_SHARE = 1 / 6  # of the points that a target moves, as faces' own targets do
_LIFT_MM = 2.0
_TURN_DEGREES = 4.0

Doubles = NDArray[np.float64]


def rigged(head: Head, targets: int) -> Head:
    """The head with morph targets all over it, and bones one above the other instead of its own."""
    points = head.positions_mm.astype(np.float64)
    rig = replace(head.control, targets=_targets(points, targets), skeleton=_skeleton(points))
    return replace(head, rig=rig)


def pose_at(head: Head, moment: int) -> Pose:
    """A pose in which every target and every bone has moved since the moment before."""
    weights = {name: 0.5 + 0.5 * math.sin(k + 0.3 * moment) for k, name in enumerate(head.targets)}
    turn = [_TURN_DEGREES * math.sin(0.2 * moment + k) for k in range(BONES)]
    bones = {name: (0.3 * angle, angle, 0.0) for name, angle in zip(head.bones, turn, strict=True)}
    return Pose(weights, bones)


def _targets(points: Doubles, count: int) -> MorphTargets:
    """Smooth lifts, each of a sixth of the points around one of them."""
    middles = points[np.linspace(0, len(points) - 1, count).astype(int)]
    nearest = max(1, int(_SHARE * len(points)))
    moved, deltas = [], []
    for middle in middles:
        away = np.linalg.norm(points - middle, axis=1)
        around = np.sort(np.argpartition(away, nearest - 1)[:nearest])
        share = 1.0 - (away[around] / max(float(away[around].max()), 1e-9)) ** 2
        moved.append(around)
        deltas.append(share[:, None] * np.array([0.0, 0.0, _LIFT_MM / count]))
    first = nearest * np.arange(count + 1)
    names = tuple(f"target {k}" for k in range(count))
    point = np.concatenate(moved).astype(np.int32)
    return MorphTargets(names, first.astype(np.int32), point, np.concatenate(deltas).astype(np.float32))


def _skeleton(points: Doubles) -> Skeleton:
    """Bones in a row upwards; a point follows the two beside it."""
    low, high = points[:, 1].min(), points[:, 1].max()
    step = (high - low) / BONES
    local, bind = np.tile(np.eye(4), (2, BONES, 1, 1))
    local[:, 1, 3] = [low, *([step] * (BONES - 1))]
    bind[:, 1, 3] = -(low + step * np.arange(BONES))
    place = np.clip((points[:, 1] - low) / step, 0.0, BONES - 1.001)
    below = place.astype(np.int32)
    bone, weight = np.zeros((len(points), 4), np.int32), np.zeros((len(points), 4), np.float32)
    bone[:, 0], bone[:, 1] = below, below + 1
    weight[:, 1] = place - below
    weight[:, 0] = 1.0 - weight[:, 1]
    parent = np.arange(-1, BONES - 1, dtype=np.int32)
    return Skeleton(tuple(f"bone {k}" for k in range(BONES)), parent, local, bind, np.eye(4), bone, weight)
