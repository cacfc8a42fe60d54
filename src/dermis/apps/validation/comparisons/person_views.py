"""Cameras, lights and poses for comparisons of people rendered by dermis and by path tracing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dermis.environment.panorama import UNIFORM_PANORAMA
from dermis.human.expressions import expression
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.scene.camera import CAMERA_PRESETS, Camera, cheek, portrait, side, three_quarter
from dermis.scene.environment import Environment
from dermis.scene.lights import Light, PointLight, RectangleLight, preset_lights
from dermis.scene.model import Scene

_SOFTBOX_SIDE_MM = 500.0
EYE_FRAME_MM = 30.0
"""Height of the field of view for pictures of an eye."""
_LIPS_FRAME_MM, _EAR_FRAME_MM = 72.0, 120.0


@dataclass(frozen=True)
class View:
    """View of a person for comparing a frame of dermis with path tracing.

    camera : function that returns the camera for a head
    light : name of a light preset or of a panorama
    pose : name of an expression; None for the rest pose
    sample_factor : factor by which the number of paths per pixel is multiplied
    """

    camera: Callable[[Head], Camera]
    light: str
    pose: str | None = None
    sample_factor: float = 1.0


def eye_camera(head: Head) -> Camera:
    """Return a camera in front of the left eye, with a field of view of 30 mm."""
    x, y, z = _eye_position_mm(head)
    return Camera(position=(x, y, z + 500.0), target=(x, y, z), frame_mm=EYE_FRAME_MM)


def eye_side_camera(head: Head) -> Camera:
    """Return a camera on the outer side of the left eye."""
    x, y, z = _eye_position_mm(head)
    return Camera(position=(x + 380.0, y, z + 330.0), target=(x, y, z), frame_mm=EYE_FRAME_MM)


def lips_camera(head: Head) -> Camera:
    """Return a camera in front of the mouth, a little to its left."""
    x, y, z = head.frontmost_point_mm(0.0, _mouth_height_mm(head))
    return Camera(position=(x + 120.0, y, z + 500.0), target=(x, y - 4.0, z), frame_mm=_LIPS_FRAME_MM)


def behind_ear_camera(head: Head) -> Camera:
    """Return a camera behind the left ear."""
    preset = CAMERA_PRESETS["ear"](head)
    x, y, z = preset.target
    return Camera(position=(x + 430.0, y + 10.0, z - 430.0), target=(x - 8.0, y, z), frame_mm=_EAR_FRAME_MM)


def _eye_position_mm(head: Head) -> tuple[float, float, float]:
    """Return the frontmost point of the left cornea, relative to the head's centre [mm]."""
    if head.eyes is None:
        return head.frontmost_point_mm(30.0, 0.0)
    x, y, z = head.control_rig.positions_mm[head.eyes.apex[0]] - np.array(head.centre_mm)
    return float(x), float(y), float(z)


def _mouth_height_mm(head: Head) -> float:
    """Return the mean height of the teeth relative to the head's centre [mm]."""
    names = [material.part for material in head.mesh.materials]
    teeth = [names.index(part) for part in ("upper teeth", "lower teeth") if part in names]
    vertices = np.unique(head.mesh.triangles[np.isin(head.mesh.material, teeth)])
    if not len(vertices):
        return -60.0
    return float(head.mesh.positions[vertices, 1].mean() - head.centre_mm[1])


VIEWS: dict[str, View] = {
    "portrait": View(portrait, "studio"),
    "three-quarter": View(three_quarter, "studio"),
    "profile": View(side, "studio"),
    "eye": View(eye_camera, "window", sample_factor=2.0),
    "eye from its side": View(eye_side_camera, "window", sample_factor=2.0),
    "lips and teeth": View(lips_camera, "studio", "smile-with-teeth"),
    "cheek": View(cheek, "studio"),
    "ear from behind": View(behind_ear_camera, "studio"),
    "hair": View(behind_ear_camera, "studio"),
    "portrait, window": View(portrait, "window"),
    "portrait, esplanade": View(portrait, "royal_esplanade"),
    "three-quarter, lebombo": View(three_quarter, "lebombo"),
}
PANORAMAS = ("royal_esplanade", "lebombo", UNIFORM_PANORAMA)


def view_scene(head: Head, view: View) -> Scene:
    """Return the scene of a view, with softboxes in place of point lights.

    Point lights are replaced because a path that leaves an eye through its cornea cannot hit them.
    """
    pose = None if view.pose is None else Pose(expression(view.pose))
    camera = view.camera(head)
    if view.light in PANORAMAS:
        return Scene(head, environment=Environment(name=view.light), camera=camera, pose=pose)
    lights = tuple(as_softbox(light) for light in preset_lights(view.light))
    return Scene(head, lights=lights, camera=camera, pose=pose)


def as_softbox(light: Light) -> Light:
    """Return a softbox at the position of a point light; return any other light unchanged."""
    if type(light) is RectangleLight or not isinstance(light, PointLight) or hasattr(light, "radius_mm"):
        return light
    shared = light.model_dump(include={"position", "target", "irradiance"})
    return RectangleLight(**shared, width_mm=_SOFTBOX_SIDE_MM, height_mm=_SOFTBOX_SIDE_MM)
