"""Poses in which the eyes look at a point and the eyelids follow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import refuse
from dermis.base.quantities import checked_array
from dermis.formats.motion.captures import match_targets
from dermis.human.movement import gaze_rotations
from dermis.mesh.head import Head
from dermis.mesh.pose import MAX_DISTANCE_MM, Pose
from dermis.mesh.rig import BoneRotation, Rig
from dermis.mesh.rotations import angles_matrix

Doubles = NDArray[np.float64]

MAX_GAZE_WEIGHT = 1.3
"""Largest weight of a gaze target, a morph target that turns an eye."""
_MAX_BONE_DEGREES = 36.0
_ROTATION_ITERATIONS = 6
_EYE_SIDES = "Left", "Right"
_NO_EYES_ADVICE = "Take the parametric human, or name the groups of the file's eyeballs with --eye-groups"


def looking_at(head: Head, target_mm: ArrayLike, pose: Pose | Mapping[str, float] | None = None) -> Pose:
    """Return a pose in which both eyes look at a point and the lids follow.

    If the head has gaze targets (morph targets such as ARKit's eyeLookUpLeft), they turn the eyes; otherwise
    the bones of the eyes do.

    target_mm : (3,) point to look at, relative to the head's centre [mm]
    pose : pose whose gaze is replaced; None for the rest pose

    Raises DermisError for heads without anatomical eyes and for invalid points.
    """
    base, rig, eyes = Pose.coerce(pose) or Pose(), head.control_rig, head.eyes
    if eyes is None or rig.skeleton is None:
        advice = f"{head.note}. {_NO_EYES_ADVICE}" if head.note else _NO_EYES_ADVICE
        refuse(head.name, "a head with eyes that turn", "it has none", advice)
    bounds = -MAX_DISTANCE_MM, MAX_DISTANCE_MM
    point_mm = checked_array("look at", target_mm, (3,), *bounds, "mm from the head's centre")
    eye_bones = [rig.skeleton.names[bone] for bone in rig.skeleton.bone[eyes.apex, 0]]
    gaze_targets = {rotation.target for rotation in rig.bone_rotations if rotation.bone in eye_bones}
    weights = {name: value for name, value in base.weights.items() if name not in gaze_targets}
    bones = {name: value for name, value in base.bones.items() if name not in eye_bones}
    frames = eyes.eye_matrices(rig, Pose(weights, bones, base.positions_mm).to_arrays(rig))
    resting = eyes.eye_matrices(rig, rig.rest)
    for k, (frame, rest, bone) in enumerate(zip(frames, resting, eye_bones, strict=True)):
        to_target = (frame @ np.append(point_mm + np.array(head.centre_mm), 1.0))[:3]
        to_target = to_target - [0.0, 0.0, eyes.centre_offset_mm[k]]
        angles = _rotation_angles(
            _unit_vector(rest[:3, :3].T @ to_target), _unit_vector(rest[:3, :3].T @ eyes.gaze[k])
        )
        rotations = [rotation for rotation in rig.bone_rotations if rotation.bone == bone]
        if not rotations:
            bones[bone] = [*np.clip(np.degrees(angles), -_MAX_BONE_DEGREES, _MAX_BONE_DEGREES).tolist(), 0.0]
            rotations = _eyelid_rotations(rig, _EYE_SIDES[k])
        weights |= _gaze_weights(rotations, angles)
    return Pose(weights, bones, base.positions_mm)


def _eyelid_rotations(rig: Rig, side_name: str) -> list[BoneRotation]:
    """Return the morph targets that move the eyelids of an eye, for a head whose eyes are turned by bones.

    Each target comes with the rotation of the eye at which the target has full weight.

    rig : rig of the head with the targets
    side_name : "Left" or "Right"
    """
    arkit = [rotation for rotation in gaze_rotations() if rotation.target.endswith(side_name)]
    known = match_targets([rotation.target for rotation in arkit], rig.targets.names)
    return [one._replace(target=known[one.target]) for one in arkit if one.target in known]


def _rotation_angles(target_direction: Doubles, start_direction: Doubles) -> tuple[float, float]:
    """Return the angles about x and y that rotate one unit vector to another unit vector [rad]."""
    x, y = 0.0, 0.0
    for _ in range(_ROTATION_ITERATIONS):
        current = np.array(angles_matrix((math.degrees(x), math.degrees(y), 0.0))) @ start_direction
        x += _pitch(target_direction) - _pitch(current)
        y += math.remainder(_yaw(target_direction) - _yaw(current), math.tau)
    return x, y


def _pitch(direction: Doubles) -> float:
    return -math.atan2(direction[1], math.hypot(direction[0], direction[2]))


def _yaw(direction: Doubles) -> float:
    return math.atan2(direction[0], direction[2])


def _unit_vector(vector: Doubles) -> Doubles:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-12))


def _gaze_weights(target_rotations: list[BoneRotation], eye_angles: tuple[float, float]) -> dict[str, Any]:
    """Return a dictionary from names of gaze targets to the weights that turn an eye by given angles.

    target_rotations : gaze targets, each with the rotation of the eye at full weight
    eye_angles : angles about x and y [rad]
    """
    target_weights = {}
    for rotation in target_rotations:
        for angle, limit in zip(np.degrees(eye_angles), rotation.degrees[:2], strict=True):
            if limit and angle / limit > 0:
                target_weights[rotation.target] = float(min(angle / limit, MAX_GAZE_WEIGHT))
    return target_weights
