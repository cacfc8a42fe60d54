"""Camera of an image: as sampled, moved as little as keeps the whole face in the picture."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.lighting import direction_from_angles
from dermis.apps.batch.sampling import Parameters, table_numbers
from dermis.mesh.head import Head
from dermis.mesh.rig import Motion
from dermis.scene.camera import Camera

_SENSOR_MM = 24.0
_MARGIN = 0.96  # of half the picture that the face may reach
_STEPS = 12
_FACE_MM = ((-90.0, -95.0, 5.0), (90.0, 100.0, 130.0))
"""Least and greatest places of a face, from the head's centre at rest."""
Doubles = NDArray[np.float64]
Aim = tuple[float, float]


def face_points(head: Head, count: int = 64) -> NDArray[np.int32]:
    """Return control points (n,) that are extreme in some direction and bound all others of a face."""
    places = head.control.positions_mm - np.array(head.centre_mm, np.float32)
    low, high = np.array(_FACE_MM, np.float32)
    within = [(one > least) & (one < most) for one, least, most in zip(places.T, low, high, strict=True)]
    inside = np.flatnonzero(within[0] & within[1] & within[2])
    if not len(inside):
        inside = np.arange(len(places))
    return np.unique(inside[(_directions(count) @ places[inside].T).argmax(axis=1)]).astype(np.int32)


def sampled_camera(
    parameters: Parameters, head: Head, points: NDArray[np.int32], motion: Motion, aspect: float
) -> Camera:
    """Return the camera of an image by its parameters.

    points : of the face, as `face_points` finds them
    aspect : width of the picture over its height
    """
    face = head.control.some_posed(points, motion) - np.array(head.centre_mm)
    values = table_numbers(parameters, "camera")
    distance = values["distance_mm"]
    frame = values.get("frame_mm") or distance * _SENSOR_MM / values["focal_mm"]
    middle = 0.5 * (face.min(axis=0) + face.max(axis=0))
    axes = _axes(values["yaw_deg"], values["pitch_deg"], values["roll_deg"])
    placed = (face - middle) @ axes.T  # right, up and towards the camera, from the face's middle
    offset = values["offset_x"] * aspect, values["offset_y"]
    frame *= max(_reach(placed, distance, (0.0, 0.0), frame, aspect) / _MARGIN, 1.0)

    def aim(share: float) -> Aim:
        """Return the aim for a share of the offset."""
        return -0.5 * frame * share * offset[0], -0.5 * frame * share * offset[1]

    share, least, most = 1.0, 0.0, 1.0
    for _ in range(_STEPS):  # bisection, after the whole offset
        inside = _reach(placed, distance, aim(share), frame, aspect) <= _MARGIN
        least, most = (share, most) if inside else (least, share)
        share = 0.5 * (least + most)
    return _aimed(middle, axes, distance, frame, aim(least))


def _aimed(middle: Doubles, axes: Doubles, distance: float, frame_mm: float, aim: Aim) -> Camera:
    """Return a camera that is aimed at a point beside the middle of the face.

    axes : (3, 3) rows: right, up, and back towards the camera
    frame_mm : height of what it would show at the middle were it aimed there
    aim : how far right and above the middle [mm]
    """
    scale = math.hypot(distance, *aim) / distance  # the angle of view stays
    return Camera(
        position=_triple(middle + distance * axes[2]),
        target=_triple(middle + aim[0] * axes[0] + aim[1] * axes[1]),
        up=_triple(axes[1]),
        frame_mm=frame_mm * scale,
    )


def _reach(placed: Doubles, distance: float, aim: Aim, frame_mm: float, aspect: float) -> float:
    """Return the greatest distance of points from the picture's middle, 1 at its edges.

    placed : (n, 3) right, up and back from the middle of the face [mm]
    """
    x, y, z = placed.T
    back = np.array([-aim[0], -aim[1], distance])
    back /= math.hypot(*back)
    right = np.array([back[2], 0.0, -back[0]]) / math.hypot(back[0], back[2])
    up = back[1] * right[2], back[2] * right[0] - back[0] * right[2], -back[1] * right[0]
    away = distance - z
    depth = np.maximum(back[2] * away - back[0] * x - back[1] * y, 1e-3)
    seen_x = (right[0] * x - right[2] * away) / (aspect * depth)
    seen_y = (up[0] * x + up[1] * y - up[2] * away) / depth
    return float(max(np.abs(seen_x).max(), np.abs(seen_y).max()) * 2.0 * distance / frame_mm)


def _axes(yaw_deg: float, pitch_deg: float, roll_deg: float) -> Doubles:
    """Return the axes of a camera, rows right, up and back (3, 3), rolled clockwise about the last."""
    back = np.array(direction_from_angles(yaw_deg, pitch_deg))
    yaw, roll = math.radians(yaw_deg), math.radians(roll_deg)
    right = np.array([math.cos(yaw), 0.0, -math.sin(yaw)])
    pitch = math.radians(pitch_deg)
    up = np.array([-math.sin(yaw) * math.sin(pitch), math.cos(pitch), -math.cos(yaw) * math.sin(pitch)])
    cosine, sine = math.cos(roll), math.sin(roll)
    return np.stack([cosine * right - sine * up, cosine * up + sine * right, back])


def _triple(vector: Doubles) -> tuple[float, float, float]:
    x, y, z = map(float, vector)
    return x, y, z


@cache
def _directions(count: int) -> NDArray[np.float32]:
    """Return directions (n, 3) on a spiral over the sphere."""
    pitches = np.degrees(np.arcsin(1.0 - 2.0 * (np.arange(count) + 0.5) / count))
    turns = 137.50776405 * np.arange(count)
    return np.array([direction_from_angles(*one) for one in zip(turns.tolist(), pitches.tolist(), strict=True)], np.float32)
