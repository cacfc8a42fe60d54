"""Camera and light navigation: orbit, pan, dolly, focus, picking and easing."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.viewer.posing import posed_positions
from dermis.apps.viewer.state import ViewerState, changed
from dermis.scene.camera import Camera
from dermis.scene.lights import DirectionalLight, Light
from dermis.scene.model import Scene
from dermis.scene.plain import FARTHEST_MM

Floats = NDArray[np.float64]
_STEEPEST = math.radians(85.0)
_NEAREST_MM = 90.0  # from the target: any nearer and the camera would enter the head
_FRAME_MM = (4.0, 3000.0)
_EASING_S = 0.05  # time constant of the exponential decay


def axes(camera: Camera) -> tuple[Floats, Floats, Floats]:
    """Unit vectors to the right, up and forward of the image."""
    forward = _unit(np.subtract(camera.target, camera.position))
    right = _unit(np.cross(forward, camera.up))
    return right, np.cross(right, forward), forward


def orbit(camera: Camera, yaw: float, pitch: float) -> Camera:
    """Turn around the target, to the right and up, but never over the top [rad]."""
    up = _unit(np.array(camera.up, dtype=np.float64))
    away = np.subtract(camera.position, camera.target)
    distance = float(np.linalg.norm(away))
    elevation = math.asin(max(-1.0, min(1.0, float(away @ up) / distance)))
    limit = max(_STEEPEST, abs(elevation))
    level = _rotation(up, yaw) @ _unit(away - (away @ up) * up)
    elevation = max(-limit, min(limit, elevation + pitch))
    away = distance * (math.cos(elevation) * level + math.sin(elevation) * up)
    return _placed(camera, np.array(camera.target) + away, camera.target)


def pan(camera: Camera, right: float, up: float) -> Camera:
    """Shift along the image plane, in fractions of the image height."""
    x, y, _ = axes(camera)
    shift = camera.frame_mm * (right * x + up * y)
    return _placed(camera, camera.position + shift, camera.target + shift)


def dolly(camera: Camera, factor: float) -> Camera:
    """Move nearer (factor below 1) or farther; within 90 mm of the target the lens zooms instead."""
    frame = max(_FRAME_MM[0], min(_FRAME_MM[1], factor * camera.frame_mm))
    away = np.subtract(camera.position, camera.target)
    distance = float(np.linalg.norm(away))
    wanted = distance * frame / camera.frame_mm
    moved = max(min(wanted, FARTHEST_MM / 10), min(distance, _NEAREST_MM))
    return _placed(camera, np.array(camera.target) + away * (moved / distance), camera.target, frame_mm=frame)


def focus(camera: Camera, point: ArrayLike) -> Camera:
    """Make a point the target, keeping direction and distance."""
    shift = np.subtract(point, camera.target)
    return _placed(camera, np.array(camera.position) + shift, point)


class Easing:
    """Moves the displayed camera smoothly to the wanted one, at the same speed for every frame rate."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera

    def advance(self, wanted: Camera, seconds: float) -> Camera:
        """The camera to display after some time [s]."""
        if self.camera != wanted:
            self.camera = between(self.camera, wanted, -math.expm1(-seconds / _EASING_S))
        return self.camera


def between(a: Camera, b: Camera, t: float) -> Camera:
    """Interpolate two cameras: directions turn, distances and frames scale. Snaps to `b` when close."""
    if t >= 1.0:
        return b
    target = _mixed(a.target, b.target, t)
    from_a, from_b = np.subtract(a.position, a.target), np.subtract(b.position, b.target)
    lengths = [float(np.linalg.norm(away)) for away in (from_a, from_b)]
    direction = _mixed(from_a / lengths[0], from_b / lengths[1], t)
    if np.linalg.norm(direction) < 1e-3:  # opposite sides: no path is better than another
        return b
    up = _mixed(a.up, b.up, t)
    distance = lengths[0] * (lengths[1] / lengths[0]) ** t
    frame = a.frame_mm * (b.frame_mm / a.frame_mm) ** t
    mixed = changed(
        b,
        position=_vector(target + distance * _unit(direction)),
        target=_vector(target),
        up=_vector(up) if np.linalg.norm(np.cross(up, direction)) > 1e-3 else b.up,
        frame_mm=frame,
        principal_point=tuple(_mixed(a.principal_point, b.principal_point, t).tolist()),
    )
    return b if _same(mixed, b) else mixed


def pick(scene: Scene, camera: Camera, x: float, y: float, aspect: float) -> Floats | None:
    """The surface point under a pixel, relative to the head's centre [mm]; None beside the head.

    scene : whose head, as it is posed
    camera : instead of the scene's
    x, y : in the image, from -1 (left, bottom) to 1
    aspect : image width over height

    Source: [MollerTrumbore1997].
    """
    right, up, forward = axes(camera)
    half, shift = camera.window(aspect)
    ray = forward + (x + shift[0]) * half[0] * right + (y + shift[1]) * half[1] * up
    head, places = scene.head, posed_positions(scene)
    eye = np.array(camera.position) + head.centre_mm
    a, b, c = (places[head.mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    e1, e2, s = b - a, c - a, eye - a
    p, q = np.cross(ray, e2), np.cross(s, e1)
    det = (e1 * p).sum(axis=1)
    meets = np.abs(det) > 1e-12
    inverse = 1.0 / np.where(meets, det, 1.0)
    u, v, t = (inverse * (pair[0] * pair[1]).sum(axis=1) for pair in ((s, p), (q, ray), (q, e2)))
    hit = meets & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)
    if not hit.any():
        return None
    return np.asarray(eye + t[hit].min() * ray - head.centre_mm)


def drag_light(state: ViewerState, index: int, right: float, up: float) -> ViewerState:
    """Orbit a light around the head, as seen in the image, or rotate the environment.

    index : of the light; any other number means the environment
    right, up : [rad]
    """
    if index < len(state.scene.lights):
        lights = list(state.scene.lights)
        lights[index] = orbit_light(lights[index], state.scene.camera, right, up)
        return state.with_lights(lights)
    environment = state.scene.environment
    if environment is None:
        return state
    degrees = (environment.rotation_degrees + math.degrees(right) + 180.0) % 360.0 - 180.0
    return state.with_environment(changed(environment, rotation_degrees=degrees))


def orbit_light(light: Light, camera: Camera, right: float, up: float) -> Light:
    """Turn a light around its target; a parallel light changes its direction."""
    x, y, _ = axes(camera)
    turn = _rotation(y, right) @ _rotation(x, -up)
    if isinstance(light, DirectionalLight):
        return changed(light, direction=_vector(turn @ np.array(light.direction)))
    away = turn @ np.subtract(light.position, light.target)
    return changed(light, position=_vector(np.array(light.target) + away))


def _same(a: Camera, b: Camera) -> bool:
    """Return whether the difference between two cameras is too small to see."""
    off = [np.abs(np.subtract(getattr(a, name), getattr(b, name))).max() for name in ("position", "target")]
    off += np.abs(np.subtract(a.principal_point, b.principal_point) * b.frame_mm).tolist()
    return max(off) < 5e-4 * b.frame_mm and abs(a.frame_mm - b.frame_mm) < 5e-4 * b.frame_mm


def _placed(camera: Camera, position: ArrayLike, target: ArrayLike, **fields: float) -> Camera:
    return changed(camera, position=_vector(position), target=_vector(target), **fields)


def _vector(v: ArrayLike) -> tuple[float, float, float]:
    x, y, z = (float(c) for c in np.clip(v, -FARTHEST_MM, FARTHEST_MM))
    return x, y, z


def _mixed(a: ArrayLike, b: ArrayLike, t: float) -> Floats:
    return (1.0 - t) * np.array(a, dtype=np.float64) + t * np.array(b, dtype=np.float64)


def _rotation(axis: Floats, angle: float) -> Floats:
    """(3, 3) rotation around a unit axis [rad]."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross))


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v))
