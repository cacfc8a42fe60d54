"""Where and in which light a person is compared with its path-traced likeness."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dermis.environment.panorama import UNIFORM
from dermis.human.expressions import expression
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.scene.camera import PRESETS, Camera, side, three_quarter
from dermis.scene.camera import cheek as at_cheek
from dermis.scene.camera import portrait as from_front
from dermis.scene.environment import Environment
from dermis.scene.lights import Light, PointLight, RectangleLight, preset_lights
from dermis.scene.model import Scene

_SOFTBOX_MM = 500.0
EYE_MM = 30.0
"""Height of the pictures of an eye."""
_LIPS_MM, _EAR_MM = 72.0, 120.0


@dataclass(frozen=True)
class View:
    """What is looked at.

    camera : before a head
    light : a preset's name, or a panorama's
    pose : name of an expression
    times : by how much more paths it takes than others
    """

    camera: Callable[[Head], Camera]
    light: str
    pose: str | None = None
    times: float = 1.0


def at_eye(head: Head) -> Camera:
    """The left eye from the front, 30 mm of it."""
    x, y, z = _eye_mm(head)
    return Camera(position=(x, y, z + 500.0), target=(x, y, z), frame_mm=EYE_MM)


def at_eye_beside(head: Head) -> Camera:
    """The left eye from its outer side."""
    x, y, z = _eye_mm(head)
    return Camera(position=(x + 380.0, y, z + 330.0), target=(x, y, z), frame_mm=EYE_MM)


def at_lips(head: Head) -> Camera:
    """The mouth from a little to the left."""
    x, y, z = head.frontmost(0.0, _mouth_mm(head))
    return Camera(position=(x + 120.0, y, z + 500.0), target=(x, y - 4.0, z), frame_mm=_LIPS_MM)


def behind_ear(head: Head) -> Camera:
    """The left ear from behind."""
    usual = PRESETS["ear"](head)
    x, y, z = usual.target
    return Camera(position=(x + 430.0, y + 10.0, z - 430.0), target=(x - 8.0, y, z), frame_mm=_EAR_MM)


def _eye_mm(head: Head) -> tuple[float, float, float]:
    """The left eye's apex, from the head's centre."""
    if head.eyes is None:
        return head.frontmost(30.0, 0.0)
    x, y, z = head.control.positions_mm[head.eyes.apex[0]] - np.array(head.centre_mm)
    return float(x), float(y), float(z)


def _mouth_mm(head: Head) -> float:
    """Height of the mouth: where upper and lower teeth meet, in the mean."""
    names = [material.part for material in head.mesh.materials]
    teeth = [names.index(part) for part in ("upper teeth", "lower teeth") if part in names]
    chosen = np.unique(head.mesh.triangles[np.isin(head.mesh.material, teeth)])
    if not len(chosen):
        return -60.0
    return float(head.mesh.positions[chosen, 1].mean() - head.centre_mm[1])


VIEWS: dict[str, View] = {
    "portrait": View(from_front, "studio"),
    "three-quarter": View(three_quarter, "studio"),
    "profile": View(side, "studio"),
    "eye": View(at_eye, "window", times=2.0),
    "eye from its side": View(at_eye_beside, "window", times=2.0),
    "lips and teeth": View(at_lips, "studio", "smile-with-teeth"),
    "cheek": View(at_cheek, "studio"),
    "ear from behind": View(behind_ear, "studio"),
    "portrait, window": View(from_front, "window"),
    "portrait, esplanade": View(from_front, "royal_esplanade"),
    "three-quarter, lebombo": View(three_quarter, "lebombo"),
}
PANORAMAS = ("royal_esplanade", "lebombo", UNIFORM)


def scene_of(head: Head, view: View) -> Scene:
    """A head in a view, in lights that have a size: through a refracting cornea no path finds a point."""
    given = {"camera": view.camera(head), "pose": None if view.pose is None else Pose(expression(view.pose))}
    if view.light in PANORAMAS:
        return Scene(head, environment=Environment(name=view.light), **given)  # type: ignore[arg-type]
    lights = tuple(softbox(light) for light in preset_lights(view.light))
    return Scene(head, lights=lights, **given)  # type: ignore[arg-type]


def softbox(light: Light) -> Light:
    """A light from a point as a softbox in its place; any other as it is."""
    if type(light) is RectangleLight or not isinstance(light, PointLight) or hasattr(light, "radius_mm"):
        return light
    return RectangleLight(
        position=light.position,
        target=light.target,
        irradiance=light.irradiance,
        width_mm=_SOFTBOX_MM,
        height_mm=_SOFTBOX_MM,
    )
