"""Captured motion of the clips of a data set."""

from __future__ import annotations

import numpy as np

from dermis.base.errors import refuse
from dermis.mesh.clip import Clip
from dermis.mesh.pose import Pose
from dermis.mesh.rotations import angles_matrix, matrix_angles

_GAZE_WORD = "eyelook"
Angles = tuple[float, float, float]


def capture_pose(capture: Clip, start: float, time_s: float, clip_s: float, frame_s: float) -> Pose:
    """Return the pose of a capture at a time of a clip.

    start : start of the clip in the capture, from the earliest (0) to the latest (1) possible one [-]
    time_s : time since the first frame of the clip [s]
    clip_s : duration of the clip, including its last frame [s]
    frame_s : duration of a frame; the capture also covers the frames before and after the clip [s]

    Raises DermisError for a capture that is shorter than the clip.
    """
    spare_s = capture.duration_s - clip_s - frame_s
    if spare_s < -1e-6:
        actual = f"{capture.name} has {capture.duration_s:.4g} s"
        expected = f"captures of {clip_s + frame_s:.4g} s or more, for the clip and the frames beside it"
        refuse("clip: motion", expected, actual, "Reduce frames, raise rate_hz, or remove the file")
    return capture.pose_at(frame_s + start * max(spare_s, 0.0) + time_s)


def moves_eyes(capture: Clip) -> bool:
    """Return whether a capture contains movements of the eyes."""
    return any(_GAZE_WORD in name.lower() for name in capture.targets)


def with_capture(pose: Pose, captured: Pose) -> Pose:
    """Return a pose with the weights of a captured pose and its rotations, which are applied first."""
    bones: dict[str, Angles] = {name: _angles(value) for name, value in pose.bones.items()}
    for name, value in captured.bones.items():
        rotation = np.array(angles_matrix(_angles(value)))
        if name in bones:
            rotation = np.array(angles_matrix(bones[name])) @ rotation
        bones[name] = matrix_angles(rotation)
    return Pose({**pose.weights, **captured.weights}, bones)


def _angles(value: object) -> Angles:
    x, y, z = map(float, np.asarray(value, np.float64))
    return x, y, z
