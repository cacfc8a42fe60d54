"""Conversion of the arguments of `Scene`, such as names and mappings, to heads, lights and cameras."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from dermis.base.errors import format_value, notify, refuse
from dermis.mesh.head import Head
from dermis.scene.camera import Camera, camera_preset
from dermis.scene.environment import Environment
from dermis.scene.frozen_model import FrozenModel, Vector
from dermis.scene.lights import Light, PointLight, light_presets, preset_lights

P = TypeVar("P", bound=FrozenModel)
_NEAR_CENTRE_MM = 5.0  # a position this close to the head's centre is a mistake in the unit


def as_head(head: object) -> Head:
    """Return a head from a `Head`, a `Human`, or a name or file name that `load_head` accepts.

    Raises DermisError for any other object.
    """
    if isinstance(head, Head):
        return head
    from dermis.human.person import Human
    from dermis.scene.heads import load_head

    if isinstance(head, Human):
        return head.head()
    if not isinstance(head, str | os.PathLike) or str(head).endswith(".toml"):
        advice = 'Write dermis.load_head("human"), or dermis.load_scene(FILE), which gives scene and settings'
        refuse("scene", "a head to show, or a scene", f"got {format_value(head)}", advice)
    return load_head(head)


def as_lights(lights: object, head: Head) -> Sequence[Light]:
    """Return a sequence of lights from several lights, a single light, or the name of a light preset.

    head : head for which the lights of a preset are placed

    Raises DermisError for any other object.
    """
    advice = "Write lights=[dermis.PointLight(position=(0, 300, 900))], or dermis.load_lights(FILE)"
    if isinstance(lights, Light):
        return _check_positions((lights,))
    if isinstance(lights, str):
        if lights not in light_presets():
            expected = f"lights, or one of the presets {', '.join(light_presets())}"
            refuse("lights", expected, f"got {lights!r}", advice)
        return preset_lights(lights, head)
    if not isinstance(lights, Iterable) or isinstance(lights, Mapping | FrozenModel):
        refuse("lights", "a list of lights", f"got {format_value(lights)}", advice)
    light_list = lights if isinstance(lights, list | tuple) else tuple(lights)
    for index, light in enumerate(light_list):
        if not isinstance(light, Light):
            refuse(f"lights[{index}]", "a light", f"got {format_value(light)}", advice)
    return _check_positions(light_list)


def as_camera(camera: object, head: Head) -> Camera:
    """Return a camera from a `Camera`, the name of a preset, or a function of the head such as `portrait`.

    Raises DermisError for any other object.
    """
    if isinstance(camera, str):
        return camera_preset(camera, head)
    if callable(camera) and not isinstance(camera, type):
        camera = camera(head)
    advice = "Write camera=dermis.portrait(head), or dermis.Camera(position=(0, 0, 1100))"
    if not isinstance(camera, Camera):
        refuse("camera", "a camera", f"got {format_value(camera)}", advice)
    _warn_near_centre("camera", camera.position)
    return camera


def as_environment(environment: object) -> Environment | None:
    """Return an environment from an `Environment` or the name of a panorama; None stays None.

    Raises DermisError for any other object.
    """
    if environment is None or isinstance(environment, Environment):
        return environment
    if not isinstance(environment, str | os.PathLike):
        advice = 'Write environment=dermis.Environment("lebombo")'
        refuse("environment", "an environment", f"got {format_value(environment)}", advice)
    return Environment(name=str(environment))


def as_model(settings_class: type[P], field_values: object, argument_name: str, example_text: str) -> P:
    """Return an instance of a settings class, built from field values.

    settings_class : class of the settings, such as `Skin`
    field_values : mapping from field names to values, or an instance, which is returned unchanged
    argument_name : name of the `Scene` argument, for the error message
    example_text : example of field values, such as 'profile="medium"', for the error message

    Raises DermisError for any other object.
    """
    if isinstance(field_values, settings_class):
        return field_values
    if not isinstance(field_values, Mapping):
        actual, advice = (
            f"got {format_value(field_values)}",
            f"Write {argument_name}=dermis.{settings_class.__name__}({example_text})",
        )
        refuse(argument_name, f"a {settings_class.__name__}", actual, advice)
    return settings_class(**field_values)


def _check_positions(lights: Sequence[Light]) -> Sequence[Light]:
    for light in lights:
        if isinstance(light, PointLight):
            _warn_near_centre("light", light.position)
    return lights


def _warn_near_centre(light_label: str, position: Vector) -> None:
    distance = float(np.linalg.norm(position))
    if 0.0 < distance < _NEAR_CENTRE_MM:
        notify(
            f"{light_label}: expected a position outside the head [mm], but it is {distance:g} mm from the "
            "centre. Write 1100 for 1.1 m."
        )
