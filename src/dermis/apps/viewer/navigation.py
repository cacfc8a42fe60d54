"""Navigation of camera and lights: orbit, pan, dolly, focus, picking and smooth motion."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.viewer.posing import posed_positions
from dermis.apps.viewer.state import ViewerState, validated_copy
from dermis.scene.camera import Camera
from dermis.scene.frozen_model import MAX_COORDINATE_MM
from dermis.scene.lights import DirectionalLight, Light
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
_MAX_ELEVATION_RAD = math.radians(85.0)
_MIN_TARGET_DISTANCE_MM = 90.0  # distance from the target; nearer cameras would enter the head
_FRAME_HEIGHT_RANGE_MM = (4.0, 3000.0)  # height of the visible frame at the target
_EASING_TIME_S = 0.05  # time constant with which the displayed camera approaches its target


def camera_axes(camera: Camera) -> tuple[Floats, Floats, Floats]:
    """Return three unit vectors of a camera: right and up in the image plane, and the forward direction."""
    forward = _normalise(np.subtract(camera.target, camera.position))
    right = _normalise(np.cross(forward, camera.up))
    return right, np.cross(right, forward), forward


def orbit(camera: Camera, yaw_rad: float, pitch_rad: float) -> Camera:
    """Orbit the camera around its target; the camera stops short of the positions directly above and below.

    yaw_rad : angle by which the camera moves to the right [rad]
    pitch_rad : angle by which the camera moves up [rad]
    """
    up = _normalise(np.array(camera.up, dtype=np.float64))
    offset = np.subtract(camera.position, camera.target)
    distance = float(np.linalg.norm(offset))
    elevation = math.asin(max(-1.0, min(1.0, float(offset @ up) / distance)))
    limit = max(_MAX_ELEVATION_RAD, abs(elevation))
    horizontal = _rotation_matrix(up, yaw_rad) @ _normalise(offset - (offset @ up) * up)
    elevation = max(-limit, min(limit, elevation + pitch_rad))
    offset = distance * (math.cos(elevation) * horizontal + math.sin(elevation) * up)
    return _with_position_and_target(camera, np.array(camera.target) + offset, camera.target)


def pan(camera: Camera, right_shift: float, up_shift: float) -> Camera:
    """Shift the camera and its target parallel to the image plane.

    right_shift : shift to the right, as a fraction of the visible height
    up_shift : shift upwards, as a fraction of the visible height
    """
    x, y, _ = camera_axes(camera)
    shift = camera.frame_mm * (right_shift * x + up_shift * y)
    return _with_position_and_target(camera, camera.position + shift, camera.target + shift)


def dolly(camera: Camera, distance_factor: float) -> Camera:
    """Move the camera nearer (factor below 1) or farther; at distances below 90 mm, zoom the lens instead.

    distance_factor : factor by which the visible height at the target is multiplied [-]
    """
    frame_mm = max(
        _FRAME_HEIGHT_RANGE_MM[0], min(_FRAME_HEIGHT_RANGE_MM[1], distance_factor * camera.frame_mm)
    )
    offset = np.subtract(camera.position, camera.target)
    old_distance = float(np.linalg.norm(offset))
    requested = old_distance * frame_mm / camera.frame_mm
    distance = max(min(requested, MAX_COORDINATE_MM / 10), min(old_distance, _MIN_TARGET_DISTANCE_MM))
    position = np.array(camera.target) + offset * (distance / old_distance)
    return _with_position_and_target(camera, position, camera.target, frame_mm=frame_mm)


def focus(camera: Camera, new_target: ArrayLike) -> Camera:
    """Shift the camera so that a point becomes its target; direction and distance stay the same."""
    shift = np.subtract(new_target, camera.target)
    return _with_position_and_target(camera, np.array(camera.position) + shift, new_target)


class CameraEasing:
    """Smooth motion of the displayed camera towards a target camera, independent of the frame rate."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera

    def advance(self, target_camera: Camera, elapsed_s: float) -> Camera:
        """Move the displayed camera towards another camera, and return the displayed camera.

        target_camera : camera to approach
        elapsed_s : time since the last call [s]
        """
        if self.camera != target_camera:
            self.camera = interpolate_cameras(
                self.camera, target_camera, -math.expm1(-elapsed_s / _EASING_TIME_S)
            )
        return self.camera


def interpolate_cameras(start_camera: Camera, end_camera: Camera, fraction: float) -> Camera:
    """Interpolate between two cameras; return `end_camera` itself if the result would look the same.

    Targets and directions are interpolated linearly, the distance and the visible height geometrically.

    fraction : position between the cameras, from 0 (start) to 1 (end)
    """
    if fraction >= 1.0:
        return end_camera
    target = _interpolate(start_camera.target, end_camera.target, fraction)
    offset_a, offset_b = (
        np.subtract(start_camera.position, start_camera.target),
        np.subtract(end_camera.position, end_camera.target),
    )
    lengths = [float(np.linalg.norm(offset)) for offset in (offset_a, offset_b)]
    direction = _interpolate(offset_a / lengths[0], offset_b / lengths[1], fraction)
    if np.linalg.norm(direction) < 1e-3:  # opposite sides: the path is undefined
        return end_camera
    up = _interpolate(start_camera.up, end_camera.up, fraction)
    distance = lengths[0] * (lengths[1] / lengths[0]) ** fraction
    frame = start_camera.frame_mm * (end_camera.frame_mm / start_camera.frame_mm) ** fraction
    camera = validated_copy(
        end_camera,
        position=_clamped_coordinates(target + distance * _normalise(direction)),
        target=_clamped_coordinates(target),
        up=_clamped_coordinates(up) if np.linalg.norm(np.cross(up, direction)) > 1e-3 else end_camera.up,
        frame_mm=frame,
        principal_point=tuple(
            _interpolate(start_camera.principal_point, end_camera.principal_point, fraction).tolist()
        ),
    )
    return end_camera if _cameras_nearly_equal(camera, end_camera) else camera


def pick(scene: Scene, camera: Camera, x: float, y: float, aspect_ratio: float) -> Floats | None:
    """Return the surface point [mm] at a position in the image; None if no surface is visible there.

    The point is relative to the centre of the head.

    scene : scene with the posed head
    camera : camera to use instead of the scene's camera
    x : horizontal position in the image, from -1 (left) to 1 (right)
    y : vertical position in the image, from -1 (bottom) to 1 (top)
    aspect_ratio : ratio of image width to height [-]

    Source: [MollerTrumbore1997].
    """
    right, up, forward = camera_axes(camera)
    half_size, shift = camera.image_rectangle(aspect_ratio)
    ray = forward + (x + shift[0]) * half_size[0] * right + (y + shift[1]) * half_size[1] * up
    head, positions = scene.head, posed_positions(scene)
    origin = np.array(camera.position) + head.centre_mm
    a, b, c = (positions[head.mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    e1, e2, s = b - a, c - a, origin - a
    p, q = np.cross(ray, e2), np.cross(s, e1)
    det = (e1 * p).sum(axis=1)
    is_crossed = np.abs(det) > 1e-12
    inverse = 1.0 / np.where(is_crossed, det, 1.0)
    u, v, t = (inverse * (pair[0] * pair[1]).sum(axis=1) for pair in ((s, p), (q, ray), (q, e2)))
    hit = is_crossed & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)
    if not hit.any():
        return None
    return np.asarray(origin + t[hit].min() * ray - head.centre_mm)


def drag_light(state: ViewerState, light_index: int, right_rad: float, up_rad: float) -> ViewerState:
    """Orbit a light around its target in the direction of a drag, or rotate the environment.

    light_index : index of the light; an index after the last light selects the environment
    right_rad : angle by which the light moves to the right on screen, or by which the environment turns [rad]
    up_rad : angle by which the light moves up on screen; ignored for the environment [rad]
    """
    if light_index < len(state.scene.lights):
        lights = list(state.scene.lights)
        lights[light_index] = orbit_light(lights[light_index], state.scene.camera, right_rad, up_rad)
        return state.with_lights(lights)
    environment = state.scene.environment
    if environment is None:
        return state
    degrees = (environment.rotation_degrees + math.degrees(right_rad) + 180.0) % 360.0 - 180.0
    return state.with_environment(validated_copy(environment, rotation_degrees=degrees))


def orbit_light(light: Light, camera: Camera, right_rad: float, up_rad: float) -> Light:
    """Rotate a light around its target, about the right and up axes of the camera.

    The rotation changes the direction of a directional light, and the position of any other light.

    right_rad : angle by which a light in front of the target moves to the right on screen [rad]
    up_rad : angle by which a light in front of the target moves up on screen [rad]
    """
    x, y, _ = camera_axes(camera)
    rotation = _rotation_matrix(y, right_rad) @ _rotation_matrix(x, -up_rad)
    if isinstance(light, DirectionalLight):
        return validated_copy(light, direction=_clamped_coordinates(rotation @ np.array(light.direction)))
    offset = rotation @ np.subtract(light.position, light.target)
    return validated_copy(light, position=_clamped_coordinates(np.array(light.target) + offset))


def _cameras_nearly_equal(first_camera: Camera, second_camera: Camera) -> bool:
    """Return whether the difference between two cameras is too small to see."""
    shifts = (
        np.subtract(first_camera.position, second_camera.position),
        np.subtract(first_camera.target, second_camera.target),
    )
    principal_shift = (
        np.subtract(first_camera.principal_point, second_camera.principal_point) * second_camera.frame_mm
    )
    differences = np.concatenate([*shifts, principal_shift, [first_camera.frame_mm - second_camera.frame_mm]])
    return bool(np.abs(differences).max() < 5e-4 * second_camera.frame_mm)


def _with_position_and_target(
    camera: Camera, position: ArrayLike, target: ArrayLike, **fields: float
) -> Camera:
    return validated_copy(
        camera, position=_clamped_coordinates(position), target=_clamped_coordinates(target), **fields
    )


def _clamped_coordinates(position_mm: ArrayLike) -> tuple[float, float, float]:
    x, y, z = (float(c) for c in np.clip(position_mm, -MAX_COORDINATE_MM, MAX_COORDINATE_MM))
    return x, y, z


def _interpolate(start_values: ArrayLike, end_values: ArrayLike, fraction: float) -> Floats:
    return (1.0 - fraction) * np.array(start_values, dtype=np.float64) + fraction * np.array(
        end_values, dtype=np.float64
    )


def _rotation_matrix(axis: Floats, angle_rad: float) -> Floats:
    """Return the (3, 3) matrix of a rotation around a unit axis.

    angle_rad : angle of the rotation [rad]
    """
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle_rad) * cross + (1.0 - math.cos(angle_rad)) * (cross @ cross))


def _normalise(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))
