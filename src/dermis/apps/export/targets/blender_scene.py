"""A scene of ours as Blender has it: metres, Z upwards, the camera and the lights around the head."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.validation.truths.cycles_scene import camera_of
from dermis.apps.validation.truths.described import UNIT_MM, world
from dermis.apps.validation.truths.lights import lamp
from dermis.mesh.head import Head
from dermis.scene.camera import Camera
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
M = 1e-3
"""Of a millimetre."""
PANORAMA = "panorama.npy"
_UNIT_M = UNIT_MM * M
_UPRIGHT = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
_AWAY_MM, _FRAME_MM = 1100.0, 140.0  # of the camera before a ball
_LENGTHS = ("shadow_soft_size", "size", "size_y")


def before_ball(ball: Head) -> Scene:
    """Studio light and a camera before a ball."""
    return Scene(ball, camera=Camera(position=(0.0, 0.0, _AWAY_MM), frame_mm=_FRAME_MM))


def surroundings(scene: Scene, centre_mm: Any) -> tuple[dict[str, Any], NDArray[Any] | None]:
    """Lights, camera and world for the script, and the panorama that goes with them.

    centre_mm : (3,) where they are placed around

    Raises DermisError for lights and cameras that Blender has not.
    """
    centre = np.array(centre_mm) * M
    lights = [_light(lamp(light, number), centre) for number, light in enumerate(scene.lights, start=1)]
    camera = camera_of(scene)
    around, panorama = world(scene.environment)
    if "turn" in around:
        around["turn"] = (np.array(around["turn"]) @ _UPRIGHT[:3, :3].T).tolist()
        around["panorama"] = PANORAMA
    told = {
        "lights": lights,
        "camera": camera | {"to_world": _placed(camera["to_world"], centre)},
        "world": around,
    }
    return told, panorama.get("panorama")


def skin_slots(head: Head) -> list[int]:
    """Which materials of the written file are skin: it has only those that triangles use."""
    used = np.unique(head.mesh.material)
    return [slot for slot, kind in enumerate(used) if head.mesh.materials[kind].kind == "skin"]


def _placed(to_world: Any, centre: Floats) -> list[list[float]]:
    """A matrix of Cycles' scenes around the head's centre, for the upright head in metres."""
    matrix = np.array(to_world, np.float64)
    matrix[:3, 3] = matrix[:3, 3] * _UNIT_M + centre
    return [[float(value) for value in row] for row in _UPRIGHT @ matrix]


def _light(described: dict[str, Any], centre: Floats) -> dict[str, Any]:
    fields = dict(described["set"])
    fields |= {name: fields[name] * _UNIT_M for name in _LENGTHS if name in fields}
    if described["type"] != "SUN":
        fields["energy"] *= _UNIT_M**2  # power, which spreads over squares of lengths
    made = described | {"set": fields, "to_world": _placed(described["to_world"], centre)}
    if "stripe" in described:
        stripe = described["stripe"]
        axes = {name: _UPRIGHT[:3, :3] @ np.array(stripe[name]) for name in ("forward", "across", "along")}
        made["stripe"] = stripe | {name: axis.tolist() for name, axis in axes.items()}
    return made
