"""Moves of a camera around what it looks at."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.scene.camera import Camera
from dermis.scene.plain import FARTHEST_MM
from dermis.viewer.state import changed

Floats = NDArray[np.float64]
_STEEPEST = math.radians(85.0)
_NEAREST_MM = 90.0  # from the target: nearer the camera would enter the head
_FRAME_MM = (4.0, 3000.0)


def axes(camera: Camera) -> tuple[Floats, Floats, Floats]:
    """Unit vectors to the right, up and forward of the image."""
    forward = _unit(np.subtract(camera.target, camera.position))
    right = _unit(np.cross(forward, camera.up))
    return right, np.cross(right, forward), forward


def orbit(camera: Camera, yaw: float, pitch: float) -> Camera:
    """Around the target, to the right and up, without going over the top [rad]."""
    up = _unit(np.array(camera.up, dtype=np.float64))
    away = np.subtract(camera.position, camera.target)
    distance = float(np.linalg.norm(away))
    height = math.asin(max(-1.0, min(1.0, float(away @ up) / distance)))
    limit = max(_STEEPEST, abs(height))
    level = _turned(_unit(away - (away @ up) * up), up, yaw)
    height = max(-limit, min(limit, height + pitch))
    away = distance * (math.cos(height) * level + math.sin(height) * up)
    return _placed(camera, np.array(camera.target) + away, camera.target)


def pan(camera: Camera, right: float, up: float) -> Camera:
    """Along the image, by shares of the image's height."""
    x, y, _ = axes(camera)
    shift = camera.frame_mm * (right * x + up * y)
    return _placed(camera, camera.position + shift, camera.target + shift)


def dolly(camera: Camera, factor: float) -> Camera:
    """Nearer (factor under 1) or farther; very near the lens zooms instead."""
    frame = max(_FRAME_MM[0], min(_FRAME_MM[1], factor * camera.frame_mm))
    away = np.subtract(camera.position, camera.target)
    distance = float(np.linalg.norm(away))
    wanted = distance * frame / camera.frame_mm
    moved = max(min(wanted, FARTHEST_MM / 10), min(distance, _NEAREST_MM))
    return _placed(camera, np.array(camera.target) + away * (moved / distance), camera.target, frame)


def focus(camera: Camera, place: Any) -> Camera:
    """On a place, from the same side and distance; later turns go around it."""
    shift = np.subtract(place, camera.target)
    return _placed(camera, np.array(camera.position) + shift, place)


def between(a: Camera, b: Camera, share: float) -> Camera:
    """A camera on the way from one to another: directions turn, distances and frames scale."""
    if share >= 1.0:
        return b
    target = _mixed(a.target, b.target, share)
    from_a, from_b = np.subtract(a.position, a.target), np.subtract(b.position, b.target)
    lengths = [float(np.linalg.norm(away)) for away in (from_a, from_b)]
    direction = _mixed(from_a / lengths[0], from_b / lengths[1], share)
    if np.linalg.norm(direction) < 1e-3:  # opposite sides: any way around is as good
        return b
    up = _mixed(a.up, b.up, share)
    distance = lengths[0] * (lengths[1] / lengths[0]) ** share
    frame = a.frame_mm * (b.frame_mm / a.frame_mm) ** share
    way = Camera(
        position=_vector(target + distance * _unit(direction)),
        target=_vector(target),
        up=_vector(up) if np.linalg.norm(np.cross(up, direction)) > 1e-3 else b.up,
        frame_mm=frame,
    )
    return b if _same(way, b) else way


def _same(a: Camera, b: Camera) -> bool:
    """Whether two cameras differ by less than one sees."""
    off = [np.abs(np.subtract(getattr(a, name), getattr(b, name))).max() for name in ("position", "target")]
    return max(off) < 5e-4 * b.frame_mm and abs(a.frame_mm - b.frame_mm) < 5e-4 * b.frame_mm


def _placed(camera: Camera, position: Any, target: Any, frame_mm: float | None = None) -> Camera:
    frame = camera.frame_mm if frame_mm is None else frame_mm
    return changed(camera, position=_vector(position), target=_vector(target), frame_mm=frame)


def _vector(v: Any) -> tuple[float, float, float]:
    x, y, z = (float(c) for c in np.clip(v, -FARTHEST_MM, FARTHEST_MM))
    return x, y, z


def _mixed(a: Any, b: Any, share: float) -> Floats:
    return (1.0 - share) * np.array(a, dtype=np.float64) + share * np.array(b, dtype=np.float64)


def _turned(v: Floats, axis: Floats, angle: float) -> Floats:
    """Around a unit axis at right angles to the vector [rad]."""
    return np.asarray(math.cos(angle) * v + math.sin(angle) * np.cross(axis, v))


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v))
