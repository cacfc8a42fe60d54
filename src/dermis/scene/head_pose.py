"""Head pose and gaze directions as labels of data sets, in the axes of an OpenCV camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.mesh.rig import PoseArrays
from dermis.scene.model import Scene
from dermis.scene.opencv import extrinsics

Doubles = NDArray[np.float64]
_HEAD_BONE = "head"


def head_pose(scene: Scene) -> Doubles:
    """Return the transform (R | t), (3, 4), from the head in rest pose to the camera: X_cam = R X + t [mm].

    X is a point of the head, relative to the centre of the head in rest pose: x to the head's left, y up, z
    to the front. The head is treated as a rigid body that moves with the bone "head"; without such a bone, it
    does not move.
    """
    rotation, shift = _camera_extrinsics(scene)
    head_rotation, head_shift = _head_bone_motion(scene)
    return np.column_stack([rotation @ head_rotation, rotation @ head_shift + shift])


def gaze_directions(scene: Scene) -> Doubles | None:
    """Return the gaze directions (2, 3) of the left and the right eye, as unit vectors in camera space.

    The result is None for heads without anatomical eyes.
    """
    head, pose_arrays = scene.head, _pose_arrays(scene)
    if head.eyes is None:
        return None
    directions = np.einsum(
        "kij,ki->kj", head.eyes.eye_matrices(head.control_rig, pose_arrays)[:, :3, :3], head.eyes.gaze
    )
    in_camera = (
        directions / np.linalg.norm(directions, axis=1, keepdims=True) @ _camera_extrinsics(scene)[0].T
    )
    return np.asarray(in_camera)


def gaze_errors_deg(scene: Scene, target_mm: ArrayLike) -> tuple[float, float] | None:
    """Return the angles between the gaze of the left and right eye and the direction to a point [degrees].

    The result is None for heads without anatomical eyes.

    target_mm : (3,) point, relative to the head's centre [mm]
    """
    head = scene.head
    if head.eyes is None:
        return None
    frames = head.eyes.eye_matrices(head.control_rig, _pose_arrays(scene))
    to_target = (frames @ np.append(np.asarray(target_mm) + np.array(head.centre_mm), 1.0))[:, :3]
    to_target[:, 2] -= head.eyes.centre_offset_mm
    across = np.linalg.norm(np.cross(to_target, head.eyes.gaze), axis=1)
    left, right = np.degrees(np.arctan2(across, (to_target * head.eyes.gaze).sum(axis=1))).tolist()
    return left, right


def _camera_extrinsics(scene: Scene) -> tuple[Doubles, Doubles]:
    camera = scene.camera
    return extrinsics(camera.position, camera.target, camera.up)


def _pose_arrays(scene: Scene) -> PoseArrays:
    return scene.head.control_rig.rest if scene.pose_arrays is None else scene.pose_arrays


def _head_bone_motion(scene: Scene) -> tuple[Doubles, Doubles]:
    """Return the head bone's motion: rotation (3, 3) about the head's centre, and translation (3,) [mm]."""
    names = [name.replace(":", " ").split()[-1:] for name in scene.head.bones]
    bone = next((k for k, name in enumerate(names) if [part.lower() for part in name] == [_HEAD_BONE]), None)
    if bone is None:
        return np.eye(3), np.zeros(3)
    matrix, centre = _pose_arrays(scene).matrices[bone].astype(np.float64), np.array(scene.head.centre_mm)
    head_rotation = matrix[:, :3] / np.cbrt(np.linalg.det(matrix[:, :3]))
    return head_rotation, matrix[:, :3] @ centre + matrix[:, 3] - centre
