"""Edits of a head's pose: morph target weights, bone angles, and the return to the rest pose."""

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
REST_POSE = Pose()


def target_weight(scene: Scene, target_name: str) -> float:
    """Return the weight of a morph target in a scene's pose, or its rest weight if the pose has none."""
    return float(_pose_or_rest(scene).weights.get(target_name, _rest_weight(scene.head, target_name)))


def with_target_weight(scene: Scene, target_name: str, new_weight: float) -> Pose | None:
    """Return the pose of a scene with a new weight for one morph target.

    The result is None if the new pose is the rest pose.
    """
    weights = dict(_pose_or_rest(scene).weights)
    weights.pop(target_name, None)
    if new_weight != _rest_weight(scene.head, target_name):
        weights[target_name] = new_weight
    return _none_if_rest(replace(_pose_or_rest(scene), weights=weights))


def bone_angles(scene: Scene, bone_name: str) -> Angles:
    """Return the angles by which a bone is rotated about the head's x, y and z axes [degrees].

    If the pose stores the rotation as a matrix, the matrix is converted to angles.
    """
    rotation, skeleton = _pose_or_rest(scene).bones.get(bone_name), scene.head.control_rig.skeleton
    if rotation is None or skeleton is None:
        return 0.0, 0.0, 0.0
    values = np.asarray(rotation, np.float64)
    if values.shape == (3,):
        x, y, z = values.tolist()
        return x, y, z
    matrix = skeleton.head_space_transforms([skeleton.index_by_name[bone_name]], values[None])[0, :3, :3]
    return matrix_angles(matrix / np.linalg.norm(matrix, axis=0))


def with_bone_angles(scene: Scene, bone_name: str, angles_degrees: Angles) -> Pose | None:
    """Return the pose of a scene with new angles for one bone; None if the new pose is the rest pose.

    angles_degrees : rotation about the head's x, y and z axes [degrees]
    """
    bones = dict(_pose_or_rest(scene).bones)
    bones.pop(bone_name, None)
    if any(angles_degrees):
        bones[bone_name] = angles_degrees
    return _none_if_rest(replace(_pose_or_rest(scene), bones=bones))


def reset_pose(scene: Scene) -> Pose | None:
    """Return the pose of a scene without its morph target weights and bone rotations.

    Vertex positions in the pose are kept; without them, the result is None, which means the rest pose.
    """
    return _none_if_rest(replace(_pose_or_rest(scene), weights={}, bones={}))


def poses_equal(
    first_pose: Pose | Mapping[str, float] | None, second_pose: Pose | Mapping[str, float] | None
) -> bool:
    """Return whether two poses are equal.

    Arrays of vertex positions count as equal only if they are the same object.
    """
    if first_pose is second_pose:
        return True
    first, second = Pose.coerce(first_pose) or REST_POSE, Pose.coerce(second_pose) or REST_POSE
    return (
        first.positions_mm is second.positions_mm
        and dict(first.weights) == dict(second.weights)
        and first.bones.keys() == second.bones.keys()
        and all(_arrays_equal(first.bones[name], second.bones[name]) for name in first.bones)
    )


def posed_positions(scene: Scene) -> NDArray[np.floating]:
    """Return the vertex positions (v, 3) of the posed mesh, equal to those computed on the device [mm]."""
    mesh, pose_arrays = scene.head.mesh, scene.pose_arrays
    if pose_arrays is None:
        return mesh.positions
    rig = replace(scene.head.control_rig, positions_mm=pose_arrays.positions_mm)
    points = rig.pose(pose_arrays.weights.astype(np.float64), pose_arrays.matrices.astype(np.float64))
    if rig.stencils is not None:
        points = rig.stencils.points(points)
    return np.asarray(points[mesh.point])


def filter_names(names: Sequence[str], search_text: str) -> list[str]:
    """Return the names that contain a search text, ignoring case."""
    query = search_text.strip().casefold()
    return [name for name in names if query in name.casefold()]


def _pose_or_rest(scene: Scene) -> Pose:
    return scene.pose or REST_POSE


def _none_if_rest(pose: Pose) -> Pose | None:
    """Return a pose, or None if the pose equals the rest pose of the head."""
    return pose if pose.weights or pose.bones or pose.positions_mm is not None else None


def _rest_weight(head: Head, target_name: str) -> float:
    targets = head.control_rig.targets
    return 0.0 if targets.rest is None else float(targets.rest[targets.index_by_name[target_name]])


def _arrays_equal(first_array: ArrayLike, second_array: ArrayLike) -> bool:
    return first_array is second_array or np.array_equal(np.asarray(first_array), np.asarray(second_array))
