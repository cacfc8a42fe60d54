"""Directives of pbrt-v4 scene files, with positions in mm relative to the centre of the head."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.export.scene_parts import supported_lights
from dermis.apps.truths.lights import facing_irradiance
from dermis.base.errors import notify
from dermis.base.registry import Registry
from dermis.environment.panorama import UNIFORM_PANORAMA
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.lights import (
    DirectionalLight,
    Light,
    PointLight,
    RectangleLight,
    SphereLight,
    SpotLight,
    StripeLight,
)

DirectiveParameters = Mapping[str, ArrayLike | Sequence[str]]
Lines = list[str]
PICTURE_SIDE, SAMPLES_PER_PIXEL = 1024, 256
_MAX_BOUNCES = 100


def format_directive(
    directive_name: str, implementation_name: str, parameters: DirectiveParameters | None = None
) -> str:
    """Return a directive of a scene file, such as `Material "subsurface" "float eta" [ 1.4 ]`.

    directive_name : first word of the directive, such as "Material"
    implementation_name : pbrt's name of the implementation, such as "subsurface"
    parameters : dictionary from type and name, such as "float eta", to a value: a Boolean, or one or more
        texts or numbers
    """
    texts = [f'"{key}" [ {_format_value(value)} ]' for key, value in (parameters or {}).items()]
    return " ".join([directive_name, f'"{implementation_name}"', *texts])


def _format_value(parameter_value: ArrayLike | Sequence[str]) -> str:
    if isinstance(parameter_value, list) and isinstance(parameter_value[0], str):
        return " ".join(map(_format_value, parameter_value))
    if isinstance(parameter_value, str):
        return '"' + parameter_value.replace("\\", "_").replace('"', "_") + '"'
    if isinstance(parameter_value, bool):
        return str(parameter_value).lower()
    return " ".join(f"{number:.7g}" for number in np.ravel(np.asarray(parameter_value)).tolist())


def camera_directives(camera: Camera, picture_name: str) -> Lines:
    """Return the directives of camera, film and integrator, to be written before the directive WorldBegin.

    picture_name : name of the picture file that pbrt writes
    """
    vectors = np.concatenate([camera.position, camera.target, camera.up])
    half, shift = camera.image_rectangle(1.0)
    screen = [(end + shift[axis]) * half[axis] for axis in (0, 1) for end in (-1.0, 1.0)]
    film: DirectiveParameters = {
        "string filename": picture_name,
        "integer xresolution": PICTURE_SIDE,
        "integer yresolution": PICTURE_SIDE,
    }
    return [
        "Scale -1 1 1  # pbrt's coordinates are left-handed",
        f"LookAt {_format_value(vectors)}",
        format_directive("Camera", "perspective", {"float fov": 90.0, "float screenwindow": screen}),
        format_directive("Sampler", "zsobol", {"integer pixelsamples": SAMPLES_PER_PIXEL}),
        format_directive("Integrator", "volpath", {"integer maxdepth": _MAX_BOUNCES}),
        format_directive("Film", "rgb", film),
    ]


def light_directives(lights: Iterable[Light], environment: Environment | None) -> Lines:
    """Return the directives of lights and environment, and warn of those that pbrt does not support.

    Unsupported lights are replaced or omitted. A panorama is omitted.
    """
    lines = Lines()
    for number, light in enumerate(supported_lights(lights, PBRT_LIGHTS, "pbrt"), start=1):
        if PBRT_LIGHTS[light.kind] is _omit_unsupported_light:
            notify(f"pbrt has no {light.kind} light, so light {number} is omitted")
            continue
        if isinstance(light, DirectionalLight) and light.angle_degrees > 0.0:
            notify(f"pbrt has no parallel light with an angle, so the shadows of light {number} are sharp")
        lines += ["AttributeBegin", *PBRT_LIGHTS[light.kind](light), "AttributeEnd"]
    if environment is not None and environment.name != UNIFORM_PANORAMA:
        notify(f"the panorama {environment.name} is omitted, as pbrt uses another projection")
    elif environment is not None:
        lines.append(format_directive("LightSource", "infinite", {"rgb L": [environment.exposure] * 3}))
    return lines


def _light_distance_mm(light: PointLight) -> float:
    return float(np.linalg.norm(np.subtract(light.target, light.position)))


def _point_light_intensity(light: PointLight) -> NDArray[np.float64]:
    return np.asarray(np.multiply(light.irradiance, _light_distance_mm(light) ** 2))


def _point_light(light: PointLight) -> Lines:
    return [
        format_directive(
            "LightSource", "point", {"point3 from": light.position, "rgb I": _point_light_intensity(light)}
        )
    ]


def _spot_light(light: SpotLight) -> Lines:
    cone = {"float coneangle": light.outer_degrees}
    cone["float conedeltaangle"] = light.outer_degrees - light.inner_degrees
    axis = {"point3 from": light.position, "point3 to": light.target}
    return [format_directive("LightSource", "spot", {**axis, "rgb I": _point_light_intensity(light), **cone})]


def _rectangle_light(light: RectangleLight) -> Lines:
    forward = np.subtract(light.target, light.position) / _light_distance_mm(light)
    across = np.cross(forward, (0.0, 1.0, 0.0))
    if np.linalg.norm(across) < 1e-6:
        across = np.array([1.0, 0.0, 0.0])
    across = across / np.linalg.norm(across)
    above = np.cross(across, forward)
    # The order of the sides makes the normal point to the target.
    first, second = -0.5 * light.width_mm * across, 0.5 * light.height_mm * above
    corners = [np.add(light.position, a * first + b * second) for b in (-1, 1) for a in (-1, 1)]
    unit_irradiance = facing_irradiance(light.width_mm, light.height_mm, _light_distance_mm(light))
    radiance = np.divide(light.irradiance, unit_irradiance)
    return [
        format_directive("AreaLightSource", "diffuse", {"rgb L": radiance}),
        format_directive("Shape", "bilinearmesh", {"point3 P": corners}),
    ]


def _sphere_light(light: SphereLight) -> Lines:
    radiance = np.divide(light.irradiance, np.pi * (light.radius_mm / _light_distance_mm(light)) ** 2)
    return [
        f"Translate {_format_value(light.position)}",
        format_directive("AreaLightSource", "diffuse", {"rgb L": radiance}),
        format_directive("Shape", "sphere", {"float radius": light.radius_mm}),
    ]


def _directional_light(light: DirectionalLight) -> Lines:
    points = {"point3 from": (0.0, 0.0, 0.0), "point3 to": light.direction}
    return [format_directive("LightSource", "distant", {**points, "rgb L": light.irradiance})]


def _omit_unsupported_light(light: StripeLight) -> Lines:
    return []


PBRT_LIGHTS: Registry[Callable[[Any], Lines]] = Registry(
    "light of pbrt",
    {
        "point": _point_light,
        "spot": _spot_light,
        "rectangle": _rectangle_light,
        "sphere": _sphere_light,
        "directional": _directional_light,
        "stripe": _omit_unsupported_light,
    },
)
"""Functions that return the directives of a light, by the kind of light."""
