"""Camera of an image: sampled from the spec, then adjusted as little as possible to show the whole face."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.batch.lighting import direction_from_angles
from dermis.apps.batch.sampling import Parameters, table_numbers
from dermis.apps.batch.sensor.lens import Lens, view_scales
from dermis.mesh.head import Head
from dermis.mesh.rig import PoseArrays
from dermis.scene.camera import Camera

_SENSOR_HEIGHT_MM = 24.0
_CENTRAL_POINT = 0.5, 0.5
_MAX_FACE_COORDINATE = 0.96  # largest distance of the face from the picture's centre; 1 is the edge
_AIM_BISECTION_STEPS = 12
_FACE_BOX_MM = ((-90.0, -95.0, 5.0), (90.0, 100.0, 130.0))
"""Bounding box of a face: its two corners, relative to the head's centre at rest."""
Doubles = NDArray[np.float64]
AimOffset = tuple[float, float]


def face_hull_indices(head: Head, direction_count: int = 64) -> NDArray[np.int32]:
    """Return the indices (n,) of control points on the convex hull of the face.

    Control points are the points of a head's mesh before subdivision. A camera that shows all points of the
    convex hull shows the whole face.

    direction_count : number of directions; the point that lies farthest in each direction is included
    """
    positions = head.control_rig.positions_mm - np.array(head.centre_mm, np.float32)
    low, high = np.array(_FACE_BOX_MM, np.float32)
    inside = np.flatnonzero(((positions > low) & (positions < high)).all(axis=1))
    if not len(inside):
        inside = np.arange(len(positions))
    return extreme_point_indices(positions, inside, direction_count)


def extreme_point_indices(
    positions_mm: ArrayLike, candidates: NDArray[np.integer], direction_count: int
) -> NDArray[np.int32]:
    """Return the sorted indices of the points that are farthest in evenly distributed directions.

    candidates : (n,) indices of the points to choose from
    """
    points = np.asarray(positions_mm)[candidates]
    return np.unique(candidates[(_sphere_directions(direction_count) @ points.T).argmax(axis=1)]).astype(
        np.int32
    )


def sampled_camera(
    parameters: Parameters,
    head: Head,
    face_point_indices: NDArray[np.int32],
    pose_arrays: PoseArrays,
    aspect: float,
) -> Camera:
    """Return the camera with an image's sampled parameters, moved so that the whole face is in the picture.

    If the picture would cut off the face, the camera shows a larger area, and the face is placed closer to
    the picture's centre.

    face_point_indices : indices of points that bound the face, from `face_hull_indices`
    pose_arrays : displacement of the head's points by the pose
    aspect : ratio of the picture's width to its height [-]
    """
    face = head.control_rig.pose_points(face_point_indices, pose_arrays) - np.array(head.centre_mm)
    values = table_numbers(parameters, "camera")
    distance = values["distance_mm"]
    frame = values.get("frame_mm") or distance * _SENSOR_HEIGHT_MM / values["focal_mm"]
    centre = 0.5 * (face.min(axis=0) + face.max(axis=0))
    axes = _camera_axes(values["yaw_deg"], values["pitch_deg"], values["roll_deg"])
    in_view = (face - centre) @ axes.T  # right, up and towards the camera, relative to the face's centre
    offset = values["offset_x"] * aspect, values["offset_y"]
    frame *= max(
        _max_projected_coordinate(in_view, distance, (0.0, 0.0), frame, aspect) / _MAX_FACE_COORDINATE, 1.0
    )

    def scaled_aim_offset(offset_fraction: float) -> AimOffset:
        """Return the offset of the camera's target that shifts the face in the picture [mm].

        A target that is moved to the left shifts the face to the right.

        offset_fraction : fraction of the sampled shift of the face that is to be applied [-]
        """
        return -0.5 * frame * offset_fraction * offset[0], -0.5 * frame * offset_fraction * offset[1]

    fraction, low, high = 1.0, 0.0, 1.0
    for _ in range(_AIM_BISECTION_STEPS):  # the first step tries the full offset
        inside = (
            _max_projected_coordinate(in_view, distance, scaled_aim_offset(fraction), frame, aspect)
            <= _MAX_FACE_COORDINATE
        )
        low, high = (fraction, high) if inside else (low, fraction)
        fraction = 0.5 * (low + high)
    return _aim_camera(centre, axes, distance, frame, scaled_aim_offset(low))


def sampled_lens(parameters: Parameters) -> Lens | None:
    """Return the lens with an image's sampled parameters; None for a lens without distortion."""
    values = table_numbers(parameters, "lens")
    return Lens.model_validate(values) if any(values.values()) else None


def camera_behind_lens(camera: Camera, lens: Lens, picture_size: tuple[int, int]) -> Camera:
    """Return the pinhole camera that shows just what a camera with a distorting lens shows.

    picture_size : width and height [pixel]

    Raises DermisError if the lens cannot image the corners of the picture.
    """
    pinhole = camera.to_opencv(picture_size)
    scale_x, scale_y = view_scales(lens, pinhole.K, picture_size)
    if camera.principal_point == _CENTRAL_POINT:
        return camera.replace(frame_mm=max(scale_x, scale_y) * camera.frame_mm)
    (width, height), K = picture_size, pinhole.K.copy()
    K[0, 0], K[1, 1] = K[0, 0] / scale_x, K[1, 1] / scale_y
    K[:2, 2] = 0.5 * width - 0.5, 0.5 * height - 0.5
    return Camera.from_opencv(K, pinhole.R, pinhole.t, picture_size)


def _aim_camera(
    centre: Doubles, axes: Doubles, distance_mm: float, visible_height_mm: float, aim_offset: AimOffset
) -> Camera:
    """Return a camera that looks at a point beside the centre of the face.

    centre : (3,) centre of the face [mm]
    axes : (3, 3) axes of the camera as rows, from `_camera_axes`
    distance_mm : distance of the camera from the centre of the face [mm]
    visible_height_mm : visible height at the centre of the face, for a camera aimed at this centre [mm]
    aim_offset : offset of the camera's target from the centre of the face, to the right and upwards [mm]
    """
    scale = math.hypot(distance_mm, *aim_offset) / distance_mm  # keeps the angle of view
    return Camera(
        position=_as_tuple(centre + distance_mm * axes[2]),
        target=_as_tuple(centre + aim_offset[0] * axes[0] + aim_offset[1] * axes[1]),
        up=_as_tuple(axes[1]),
        frame_mm=visible_height_mm * scale,
    )


def _max_projected_coordinate(
    positions_mm: Doubles, distance_mm: float, aim_offset: AimOffset, visible_height_mm: float, aspect: float
) -> float:
    """Return the largest absolute picture coordinate of the points: 0 at the centre, 1 at an edge.

    positions_mm : (n, 3) coordinates of the points along the axes of `_camera_axes`, with the face's centre
        as the origin [mm]
    distance_mm : distance of the camera from the face's centre [mm]
    aim_offset : offset of the camera's target to the right and upwards [mm]
    visible_height_mm : visible height at the face's centre [mm]
    aspect : ratio of the picture's width to its height [-]
    """
    x, y, z = positions_mm.T
    back = np.array([-aim_offset[0], -aim_offset[1], distance_mm])
    back /= math.hypot(*back)
    right = np.array([back[2], 0.0, -back[0]]) / math.hypot(back[0], back[2])
    up = back[1] * right[2], back[2] * right[0] - back[0] * right[2], -back[1] * right[0]
    away = distance_mm - z
    depth = np.maximum(back[2] * away - back[0] * x - back[1] * y, 1e-3)
    projected_x = (right[0] * x - right[2] * away) / (aspect * depth)
    projected_y = (up[0] * x + up[1] * y - up[2] * away) / depth
    return float(
        max(np.abs(projected_x).max(), np.abs(projected_y).max()) * 2.0 * distance_mm / visible_height_mm
    )


def _camera_axes(yaw_deg: float, pitch_deg: float, roll_deg: float) -> Doubles:
    """Return the axes of a camera as rows (3, 3): right, up, and back (from the face to the camera).

    The roll turns the right and up axes clockwise, as seen by the camera.
    """
    back = np.array(direction_from_angles(yaw_deg, pitch_deg))
    yaw, roll = math.radians(yaw_deg), math.radians(roll_deg)
    right = np.array([math.cos(yaw), 0.0, -math.sin(yaw)])
    pitch = math.radians(pitch_deg)
    up = np.array([-math.sin(yaw) * math.sin(pitch), math.cos(pitch), -math.cos(yaw) * math.sin(pitch)])
    cosine, sine = math.cos(roll), math.sin(roll)
    return np.stack([cosine * right - sine * up, cosine * up + sine * right, back])


def _as_tuple(vector: Doubles) -> tuple[float, float, float]:
    x, y, z = map(float, vector)
    return x, y, z


@cache
def _sphere_directions(direction_count: int) -> NDArray[np.float32]:
    """Return unit vectors (n, 3) evenly distributed over the sphere, on a golden-angle spiral."""
    pitches = np.degrees(np.arcsin(1.0 - 2.0 * (np.arange(direction_count) + 0.5) / direction_count))
    yaws = 137.50776405 * np.arange(direction_count)  # golden angle
    return np.array(list(map(direction_from_angles, yaws.tolist(), pitches.tolist())), np.float32)
