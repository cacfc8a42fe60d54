"""Poses of the viewer: what a slider and the button for rest change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.mesh.rotations import matrix_angles
from dermis.scene.model import Scene

Angles = tuple[float, float, float]
AT_REST = Pose()


def weight_of(scene: Scene, target: str) -> float:
    """Return the weight of a morph target, by pose or at rest."""
    return float(_pose(scene).weights.get(target, _resting(scene.head, target)))


def with_weight(scene: Scene, target: str, weight: float) -> Pose | None:
    """Return the scene's pose with another weight of a target."""
    weights = dict(_pose(scene).weights)
    weights.pop(target, None)
    if weight != _resting(scene.head, target):
        weights[target] = weight
    return _shortest(replace(_pose(scene), weights=weights))


def angles_of(scene: Scene, bone: str) -> Angles:
    """Return the turn of a bone about the head's x, y and z [degrees]; of a matrix its rotation."""
    given, skeleton = _pose(scene).bones.get(bone), scene.head.control.skeleton
    if given is None or skeleton is None:
        return 0.0, 0.0, 0.0
    numbers = np.asarray(given, np.float64)
    if numbers.shape == (3,):
        x, y, z = numbers.tolist()
        return x, y, z
    turned = skeleton.changes([skeleton.index[bone]], numbers[None])[0, :3, :3]
    return matrix_angles(turned / np.linalg.norm(turned, axis=0))


def with_angles(scene: Scene, bone: str, degrees: Angles) -> Pose | None:
    """Return the scene's pose with another turn of a bone [degrees]."""
    bones = dict(_pose(scene).bones)
    bones.pop(bone, None)
    if any(degrees):
        bones[bone] = degrees
    return _shortest(replace(_pose(scene), bones=bones))


def at_rest(scene: Scene) -> Pose | None:
    """Return the scene's pose without expressions and turns; the points of the person stay."""
    return _shortest(replace(_pose(scene), weights={}, bones={}))


def same_pose(a: Pose | Mapping[str, float] | None, b: Pose | Mapping[str, float] | None) -> bool:
    """Return whether two poses are equal; places of points are compared by identity."""
    if a is b:
        return True
    one, other = Pose.of(a) or AT_REST, Pose.of(b) or AT_REST
    return (
        one.positions_mm is other.positions_mm
        and dict(one.weights) == dict(other.weights)
        and one.bones.keys() == other.bones.keys()
        and all(_alike(one.bones[name], other.bones[name]) for name in one.bones)
    )


def posed_positions(scene: Scene) -> NDArray[np.floating]:
    """Return the (v, 3) positions of the corners of the posed mesh, as the device computes them [mm]."""
    mesh, motion = scene.head.mesh, scene.motion
    if motion is None:
        return mesh.positions
    rig = replace(scene.head.control, positions_mm=motion.positions_mm)
    points = rig.posed(motion.weights.astype(np.float64), motion.matrices.astype(np.float64))
    if rig.stencils is not None:
        points = rig.stencils.points(points)
    return np.asarray(points[mesh.point])


def matching(names: Sequence[str], wanted: str) -> list[str]:
    """Return the names that contain some letters, in either case."""
    letters = wanted.strip().casefold()
    return [name for name in names if letters in name.casefold()]


def _pose(scene: Scene) -> Pose:
    return scene.pose or AT_REST


def _shortest(pose: Pose) -> Pose | None:
    """Return a pose, None for one that moves nothing."""
    return pose if pose.weights or pose.bones or pose.positions_mm is not None else None


def _resting(head: Head, target: str) -> float:
    targets = head.control.targets
    return 0.0 if targets.rest is None else float(targets.rest[targets.index[target]])


def _alike(a: ArrayLike, b: ArrayLike) -> bool:
    return a is b or np.array_equal(np.asarray(a), np.asarray(b))
