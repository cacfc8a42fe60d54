"""The camera of an image: as it is drawn, and moved as little as keeps the face in the picture."""

from __future__ import annotations

from collections.abc import Mapping
from math import radians
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.batch.lighting import towards
from dermis.mesh.head import Head
from dermis.mesh.rig import Motion
from dermis.scene.camera import Camera

_SENSOR_MM = 24.0
_MARGIN = 0.96  # of half the picture that the face may reach
_STEPS = 10
_FACE_MM = ((-90.0, -95.0, 5.0), (90.0, 100.0, 130.0))
"""Least and greatest places of a face, from the head's centre at rest."""
Doubles = NDArray[np.float64]


def face_points(head: Head, count: int = 64) -> NDArray[np.int32]:
    """(n,) control points that stand out of a face: all others lie between them."""
    places = head.control.positions_mm - np.array(head.centre_mm, np.float32)
    low, high = np.array(_FACE_MM, np.float32)
    inside = np.flatnonzero(((places > low) & (places < high)).all(axis=1))
    if not len(inside):
        inside = np.arange(len(places))
    ways = np.array([towards(*way) for way in _spiral(count)], np.float32)
    return np.unique(inside[(places[inside] @ ways.T).argmax(axis=0)]).astype(np.int32)


def camera_of(
    parameters: Mapping[str, Any], head: Head, points: NDArray[np.int32], motion: Motion, aspect: float
) -> Camera:
    """The camera of an image by its parameters.

    points : of the face, as `face_points` finds them
    aspect : width of the picture over its height
    """
    face = head.control.some_posed(points, motion) - np.array(head.centre_mm)
    values = {name.removeprefix("camera."): one for name, one in parameters.items()}
    distance = values["distance_mm"]
    frame = values.get("frame_mm") or distance * _SENSOR_MM / values["focal_mm"]
    middle = 0.5 * (face.min(axis=0) + face.max(axis=0))
    back = np.array(towards(values["yaw_deg"], values["pitch_deg"]))
    position, up = middle + distance * back, _up(back, values["roll_deg"])
    shift = np.array([values["offset_x"], values["offset_y"]])

    def aimed(share: float) -> tuple[Camera, float]:
        """The camera with a share of the shift, and how far the face reaches, of half the picture."""
        camera = _aimed(position, middle, up, frame, share * shift, aspect)
        return camera, _reach(camera, face, aspect)

    frame *= max(aimed(0.0)[1] / _MARGIN, 1.0)
    camera, reach = aimed(1.0)
    if reach <= _MARGIN:
        return camera
    least, most = 0.0, 1.0
    for _ in range(_STEPS):
        share = 0.5 * (least + most)
        least, most = (share, most) if aimed(share)[1] <= _MARGIN else (least, share)
    return aimed(least)[0]


def _aimed(
    position: Doubles, middle: Doubles, up: Doubles, frame_mm: float, shift: Doubles, aspect: float
) -> Camera:
    """A camera that sees the middle of the face so far from the middle of its picture."""
    back = position - middle
    distance = float(np.linalg.norm(back))
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    above = np.cross(back, right) / distance
    across, along = 0.5 * frame_mm * shift * [aspect, 1.0]
    target = middle - across * right - along * above
    scale = float(np.linalg.norm(target - position)) / distance  # the angle of view stays
    x, y, z = map(float, position)
    return Camera(position=(x, y, z), target=_triple(target), up=_triple(up), frame_mm=frame_mm * scale)


def _reach(camera: Camera, places: Doubles, aspect: float) -> float:
    """How far from the picture's middle points are seen, 1 at its edges; far beyond what is not before it."""
    _, R, t = camera.to_opencv((1, 1))
    x, y, z = R @ places.T + t[:, None]
    seen = np.abs(np.stack([x / aspect, y])) / (camera.half_tangent * np.maximum(z, 1e-3))
    return float(seen.max())


def _up(back: Doubles, roll_deg: float) -> Doubles:
    """What is upwards in the picture of a camera that is turned clockwise about its axis."""
    right = np.cross([0.0, 1.0, 0.0], back)
    right /= np.linalg.norm(right)
    angle = radians(roll_deg)
    return np.asarray(np.cos(angle) * np.cross(back, right) + np.sin(angle) * right)


def _triple(vector: Doubles) -> tuple[float, float, float]:
    x, y, z = map(float, vector)
    return x, y, z


def _spiral(count: int) -> list[tuple[float, float]]:
    """Directions all around, as yaw and pitch [degrees]."""
    heights = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    turns = 137.50776405 * np.arange(count)
    return list(zip(turns.tolist(), np.degrees(np.arcsin(heights)).tolist(), strict=True))
