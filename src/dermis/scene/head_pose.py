"""Where a head is and where its eyes look, in a camera's axes as OpenCV has them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.rig import Motion
from dermis.scene.model import Scene
from dermis.scene.opencv import extrinsics

Doubles = NDArray[np.float64]
_BONE = "head"


def head_pose(scene: Scene) -> Doubles:
    """(3, 4) from the head at rest to the camera: X_cam = R X + t [mm].

    X is a place on the rigid head, from its centre where it rests: x to its left, y up, z ahead. The head
    goes with the bone of that name; one without it stays, and R and t are the camera's own.
    """
    rotation, shift = _camera(scene)
    head_rotation, head_shift = _rigid_motion(scene)
    return np.column_stack([rotation @ head_rotation, rotation @ head_shift + shift])


def gaze_directions(scene: Scene) -> Doubles | None:
    """(2, 3) unit vectors along which the left and the right eye look, in the camera's axes.

    None for heads without eyes of true shape.
    """
    head, motion = scene.head, _motion(scene)
    if head.eyes is None:
        return None
    directions = np.einsum("kij,ki->kj", head.eyes.frames(head.control, motion)[:, :3, :3], head.eyes.sight)
    seen = directions / np.linalg.norm(directions, axis=1, keepdims=True) @ _camera(scene)[0].T
    return np.asarray(seen)


def _camera(scene: Scene) -> tuple[Doubles, Doubles]:
    camera = scene.camera
    return extrinsics(camera.position, camera.target, camera.up)


def _motion(scene: Scene) -> Motion:
    return scene.head.control.rest if scene.motion is None else scene.motion


def _rigid_motion(scene: Scene) -> tuple[Doubles, Doubles]:
    """Rotation and shift [mm] of places from the head's centre, from where it rests."""
    names = [name.replace(":", " ").split()[-1:] for name in scene.head.bones]
    bone = next((k for k, name in enumerate(names) if [part.lower() for part in name] == [_BONE]), None)
    if bone is None:
        return np.eye(3), np.zeros(3)
    matrix, centre = _motion(scene).matrices[bone].astype(np.float64), np.array(scene.head.centre_mm)
    head_rotation = matrix[:, :3] / np.cbrt(np.linalg.det(matrix[:, :3]))
    return head_rotation, matrix[:, :3] @ centre + matrix[:, 3] - centre
