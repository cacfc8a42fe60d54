"""Rig of fitted eyeballs, which replace the eyeballs of a file and move like them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index, Ints
from dermis.mesh.rig import BONES_PER_POINT, BoneRotation, MorphTargets, Rig, RigidFollowers, Skeleton
from dermis.mesh.rotations import matrix_angles, rigid_motion

_ROOT_BONE_NAME, _EYE_BONE_NAMES = "scene", ("eye.L", "eye.R")
_MAX_NON_EYE_FOLLOWER_RATIO = 0.05
"""Largest sum of an eye bone's weights outside the eye, relative to their sum in the eye.

The bone of a whole head exceeds this ratio.
"""
_MIN_ROTATION_DEGREES, _MIN_SHIFT_MM = 0.5, 0.02  # smaller motions of a target are ignored


class FittedEyeball(NamedTuple):
    """Fitted eyeball that replaces an eyeball of a file.

    centre : (3,) centre of the ball [mm]
    points : (n, 3) control points of the fitted eyeball [mm]
    replaced_points : (m,) indices of the control points of the file's eyeball
    """

    centre: Doubles
    points: Doubles
    replaced_points: Index


def with_eyeballs(rig: Rig, eyeballs: Sequence[FittedEyeball]) -> Rig:
    """Add fitted eyeballs to a rig; they follow the bones and targets that move the file's eyeballs.

    The control points of the fitted eyeballs come after all other control points.
    """
    skeleton, bones = _with_eye_bones(rig, eyeballs)
    first = len(rig.positions_mm) + np.cumsum([0, *(len(one.points) for one in eyeballs)])
    rotations, targets, followers = list(rig.bone_rotations), rig.targets, list(rig.rigid_followers)
    for eyeball, bone, begin in zip(eyeballs, bones, first, strict=False):
        origin = np.array(skeleton.joint_positions_mm[bone])
        own, shifts = _rigid_target_motions(rig, eyeball, skeleton.names[bone], origin)
        rotations += own
        points = begin + np.arange(len(eyeball.points))
        targets = _with_target_shifts(targets, shifts, points)
        followers.append(RigidFollowers(eyeball.replaced_points.astype(np.int32), points.astype(np.int32)))
    positions = np.concatenate([rig.positions_mm, *(one.points for one in eyeballs)]).astype(np.float32)
    return replace(
        rig,
        positions_mm=positions,
        targets=targets,
        skeleton=skeleton,
        bone_rotations=tuple(rotations),
        rigid_followers=tuple(followers),
    )


def _with_eye_bones(rig: Rig, eyeballs: Sequence[FittedEyeball]) -> tuple[Skeleton, list[int]]:
    """Return a skeleton that moves the fitted eyeballs, and the index of the bone of each eyeball.

    An eyeball gets a new bone if its bone in the file also moves other points.
    """
    skeleton = rig.skeleton or _single_bone_skeleton(len(rig.positions_mm))
    bones = _eye_bones(skeleton, eyeballs)
    for k, eyeball in enumerate(eyeballs):
        if bones[k] < 0:
            parent = int(np.argmax(_skin_weight_sums(skeleton, eyeball)))
            name = next(
                name
                for name in (_EYE_BONE_NAMES[k], f"fitted {_EYE_BONE_NAMES[k]}")
                if name not in skeleton.names
            )
            skeleton, bones[k] = _with_added_bone(skeleton, name, parent, eyeball.centre), len(skeleton.names)
    for eyeball, bone in zip(eyeballs, bones, strict=True):
        count = len(eyeball.points)
        weight = np.tile(np.eye(1, BONES_PER_POINT, dtype=np.float32), (count, 1))
        index = np.zeros((count, BONES_PER_POINT), np.int32)
        index[:, 0] = bone
        skeleton = replace(
            skeleton,
            bone=np.concatenate([skeleton.bone, index]),
            weight=np.concatenate([skeleton.weight, weight]),
        )
    return skeleton, bones


def _single_bone_skeleton(point_count: int) -> Skeleton:
    """Return a skeleton with a single bone, which all points follow.

    point_count : number of points
    """
    identity = np.eye(4)[None]
    bone, weight = (
        np.zeros((point_count, BONES_PER_POINT), np.int32),
        np.zeros((point_count, BONES_PER_POINT), np.float32),
    )
    weight[:, 0] = 1.0
    return Skeleton((_ROOT_BONE_NAME,), np.array([-1], np.int32), identity, identity, np.eye(4), bone, weight)


def _eye_bones(skeleton: Skeleton, eyeballs: Sequence[FittedEyeball]) -> list[int]:
    """Return for each eyeball the index of a bone that moves only this eyeball; -1 if there is none."""
    count, bones = len(skeleton.names), list[int]()
    total = np.bincount(skeleton.bone.ravel(), skeleton.weight.ravel(), minlength=count)
    for eyeball in eyeballs:
        own = _skin_weight_sums(skeleton, eyeball)
        bone = int(np.argmax(own))
        others = total[bone] - own[bone]
        bones.append(bone if others <= _MAX_NON_EYE_FOLLOWER_RATIO * own[bone] else -1)
    return bones


def _skin_weight_sums(skeleton: Skeleton, eyeball: FittedEyeball) -> Doubles:
    """Return for each bone the sum (b,) of its skin weights over the points of the file's eyeball."""
    bone, weight = skeleton.bone[eyeball.replaced_points], skeleton.weight[eyeball.replaced_points]
    return np.bincount(bone.ravel(), weight.ravel(), len(skeleton.names)).astype(np.float64)


def _with_added_bone(skeleton: Skeleton, bone_name: str, parent_bone: int, origin_mm: Doubles) -> Skeleton:
    """Return a skeleton with an additional bone, which no points follow yet.

    parent_bone : index of the parent of the new bone
    origin_mm : (3,) position of the joint of the new bone in head space [mm]
    """
    to_head = np.eye(4)
    to_head[:3, 3] = origin_mm
    world = np.linalg.inv(skeleton.to_head) @ to_head
    return replace(
        skeleton,
        names=(*skeleton.names, bone_name),
        parent=np.append(skeleton.parent, parent_bone).astype(np.int32),
        local=np.concatenate([skeleton.local, (skeleton.inverse_bind[parent_bone] @ world)[None]]),
        inverse_bind=np.concatenate([skeleton.inverse_bind, np.linalg.inv(world)[None]]),
    )


def _rigid_target_motions(
    rig: Rig, eyeball: FittedEyeball, bone_name: str, origin_mm: Doubles
) -> tuple[list[BoneRotation], dict[int, Doubles]]:
    """Return the rotation and translation that best fit how each morph target moves the file's eyeball.

    The first result lists rotations of the eyeball's bone. The second result is a dictionary from target
    index to translation (3,) [mm]. Targets that do not move the eyeball are left out.

    bone_name : name of the eyeball's bone
    origin_mm : (3,) position of the bone's joint [mm]
    """
    rest = rig.positions_mm[eyeball.replaced_points].astype(np.float64)
    deltas = rig.targets.dense_displacements(eyeball.replaced_points, len(rig.positions_mm)).astype(
        np.float64
    )
    rotations, shifts = list[BoneRotation](), dict[int, Doubles]()
    for index, delta in enumerate(deltas):
        if np.abs(delta).max(initial=0.0) < _MIN_SHIFT_MM:
            continue
        matrix, _ = rigid_motion(rest, rest + delta)
        x, y, z = matrix_angles(matrix)
        if np.linalg.norm((x, y, z)) < _MIN_ROTATION_DEGREES:
            matrix = np.eye(3)
        else:
            rotations.append(BoneRotation(rig.targets.names[index], bone_name, (x, y, z)))
        centre = rest.mean(axis=0)
        shift = delta.mean(axis=0) - (matrix - np.eye(3)) @ (centre - origin_mm)
        if np.linalg.norm(shift) > _MIN_SHIFT_MM:
            shifts[index] = shift
    return rotations, shifts


def _with_target_shifts(
    targets: MorphTargets, shift_of_target: dict[int, Doubles], eyeball_points: Index
) -> MorphTargets:
    """Return morph targets that also translate the points of a fitted eyeball.

    shift_of_target : dictionary from target index to translation (3,) [mm]
    eyeball_points : (n,) indices of the control points of the eyeball
    """
    if not shift_of_target:
        return targets
    point, delta, count = list[Ints](), list[Floats](), [0]
    for index in range(len(targets.names)):
        indices = [targets.point[targets.displacement_rows(index)]]
        deltas = [targets.delta_mm[targets.displacement_rows(index)]]
        if index in shift_of_target:
            indices.append(eyeball_points.astype(np.int32))
            deltas.append(np.tile(shift_of_target[index].astype(np.float32), (len(eyeball_points), 1)))
        point += indices
        delta += deltas
        count.append(sum(map(len, indices)))
    first = np.cumsum(count).astype(np.int32)
    return replace(targets, first=first, point=np.concatenate(point), delta_mm=np.concatenate(delta))
