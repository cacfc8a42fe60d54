"""Moves of lights around the head."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dermis.scene.camera import Camera
from dermis.scene.lights import DirectionalLight, Light
from dermis.viewer.orbit import Floats, axes
from dermis.viewer.state import ViewerState, changed


def drag_light(state: ViewerState, index: int, right: float, up: float) -> ViewerState:
    """One light carried around the head as the image shows it; without lights the environment turns.

    index : of the light; one that does not exist is the environment
    right, up : [rad]
    """
    if index < len(state.scene.lights):
        moved = turned_light(state.scene.lights[index], state.scene.camera, right, up)
        lights = [moved if k == index else light for k, light in enumerate(state.scene.lights)]
        return state.with_lights(lights)
    environment = state.scene.environment
    if environment is None:
        return state
    degrees = (environment.rotation_degrees + math.degrees(right) + 180.0) % 360.0 - 180.0
    return state.with_environment(changed(environment, rotation_degrees=degrees))


def turned_light(light: Light, camera: Camera, right: float, up: float) -> Light:
    """A light carried around its target; parallel light turns its direction."""
    x, y, _ = axes(camera)
    turn = _rotation(y, right) @ _rotation(x, -up)
    if isinstance(light, DirectionalLight):
        return changed(light, direction=_listed(turn @ np.array(light.direction)))
    away = turn @ np.subtract(light.position, light.target)
    return changed(light, position=_listed(np.array(light.target) + away))


def _rotation(axis: Floats, angle: float) -> Floats:
    """The matrix of a turn around a unit axis [rad]."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross))


def _listed(v: Any) -> tuple[float, ...]:
    return tuple(float(c) for c in v)
