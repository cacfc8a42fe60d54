"""The scene's lights as the shaders read them, and how each sees the head."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.assets.environment.suns import Sun
from dermis.assets.head import Head
from dermis.errors import refuse
from dermis.gpu import ComputeProgram
from dermis.rendering.projection import ShadowView, Triple, between, frame_of, place_of, shadow_view
from dermis.rendering.rectangles import facing_irradiance, parts_of
from dermis.rendering.stages.variants import Switches
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
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
_KINDS = (PointLight, SpotLight, DirectionalLight, StripeLight, RectangleLight, SphereLight)
_MOST_LIGHTS = 64  # in lights.wgsl
_UP = np.array([0.0, 1.0, 0.0])
_WIDEST_SHADOW_FILTER = 6
_SIDE, _PART_SIDE = 4, 2  # a light of some size is shaded as SIDE x SIDE lights, a part as fewer
_LINES, _LEAST_LINES, _SUN_LINES = 64, 12, 32  # of sight to places on a light, for its shadow


def sun_lights(suns: tuple[Sun, ...], environment: Environment) -> tuple[DirectionalLight, ...]:
    """The peaks of a panorama as lights, turned and exposed with it."""
    angle = np.radians(environment.rotation_degrees)
    lights = []
    for sun in suns:
        x, y, z = -sun.direction
        lights.append(
            # Not checked: with the exposure it may be brighter than lights that are written down.
            DirectionalLight.model_construct(
                direction=(np.cos(angle) * x + np.sin(angle) * z, y, np.cos(angle) * z - np.sin(angle) * x),
                irradiance=tuple(environment.exposure * sun.irradiance),
                angle_degrees=float(np.degrees(2.0 * sun.radius)),
                softness_mm=0.5,
            )
        )
    return tuple(lights)


def light_switches(scene: Scene) -> Switches:
    """Values of the `override`s of lighting.wgsl that what is lit and what lights it call for."""
    shapes = StripeLight, RectangleLight, SphereLight
    wide = any(isinstance(light, DirectionalLight) and light.angle_degrees > 0 for light in scene.lights)
    shaped = wide or any(isinstance(light, shapes) for light in scene.lights)
    named = {
        "SHAPES": shaped,
        "ENVIRONMENT": scene.environment,
        "HALF_SPACE": scene.skin.direction != "lambertian",
    }
    return tuple((name, 1) for name, used in named.items() if used)


def light_views(scene: Scene, size: int) -> list[ShadowView | None]:
    """How each part of each light sees the head; None for those without shadows.

    Raises DermisError for more lights than the shader holds, and for one that the head reaches into.
    """
    numbered = [
        (f"light {k}", part) for k, light in enumerate(scene.lights, start=1) for part in parts_of(light)
    ]
    if len(numbered) > _MOST_LIGHTS:
        came = f"there are {len(numbered)}, with the environment's suns and each part of a large rectangle"
        refuse("lights", f"at most {_MOST_LIGHTS}", came, "Leave some out")
    return [_view(scene.head, light, size, culprit) for culprit, light in numbered]


def _view(head: Head, light: Light, size: int, culprit: str) -> ShadowView | None:
    if isinstance(light, SphereLight):
        middle = place_of(light.position, head.centre_mm)
        near = float(np.linalg.norm(head.mesh.positions - np.array(middle), axis=1).min())
        if near <= light.radius_mm:
            came = f"the head is {near:.0f} mm from its middle"
            refuse(culprit, f"a head outside the sphere of {light.radius_mm:g} mm", came, "Move it away")
    return shadow_view(light, head.centre_mm, head.mesh, size, culprit) if light.shadows else None


def light_records(program: ComputeProgram, scene: Scene, views: list[ShadowView | None]) -> Any:
    """The shader's array of lights.

    views : one for each part of each light
    """
    record = program.record("Lights")
    record["place"] = places_on_lights()
    divided = [(part, len(parts)) for parts in map(parts_of, scene.lights) for part in parts]
    layer = 0
    for index, ((light, siblings), view) in enumerate(zip(divided, views, strict=True)):
        one = record["light"][index]
        _fill(one, light, scene.head.centre_mm, view)
        one["layer"] = layer if view else -1
        few = isinstance(light, DirectionalLight)
        one["lines"] = _SUN_LINES if few else max(_LEAST_LINES, _LINES // siblings)
        one["side"] = _PART_SIDE if siblings > 1 else _SIDE
        layer += view is not None
    return record


@cache
def places_on_lights() -> Floats:
    """(64, 4) places spread evenly [Roberts2018] over a disc and over a square, both from -1 to 1."""
    even = (0.5 + np.arange(_LINES)[:, None] * [0.7548776662, 0.5698402910]) % 1.0
    phi = 2.0 * np.pi * even[:, 1]
    disc = np.sqrt(even[:, :1]) * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    return np.hstack([disc, 2.0 * even - 1.0])


def _fill(record: Any, light: Light, centre: Triple, view: ShadowView | None) -> None:
    """A light's element of the shader's array."""
    record["kind"], record["irradiance"] = _KINDS.index(type(light)), light.irradiance
    distance, texel = 1.0, view.texel if view else 1.0
    if isinstance(light, DirectionalLight):
        length = math.hypot(*light.direction)
        record["direction"] = tuple(c / length for c in light.direction)
    else:
        path = between(light.position, light.target)
        distance = math.hypot(*path)
        record["direction"] = tuple(c / distance for c in path)
        record["position"] = place_of(light.position, centre)
    record["reference_mm"] = distance
    if view:
        record["position"] = view.origin
        record["to_map"], record["texel"] = view.clip.T, texel
        record["map_right"], record["map_up"] = view.right, view.up
        record["map_near"], record["map_far"] = view.near, view.far
    _add_shape(record, light, centre, distance)
    # A tent of half width h fades over 2 h texels.
    record["softness"] = 0.5 * light.softness_mm
    half_width = round(0.5 * light.softness_mm / (texel * distance))
    record["half_width"] = min(max(half_width, 1), _WIDEST_SHADOW_FILTER)


def _add_shape(record: Any, light: Light, centre: Triple, distance: float) -> None:
    """What only some kinds have: a cone, a stripe, or a size; lights of some size carry their radiance."""
    if isinstance(light, SpotLight):
        record["cos_inner"] = math.cos(math.radians(light.inner_degrees))
        record["cos_outer"] = math.cos(math.radians(light.outer_degrees))
    elif isinstance(light, StripeLight):
        right, up, _ = frame_of(record["direction"].astype(float), np.array(light.up))
        record["position"] = place_of(light.position, centre)
        record["half_u"], record["half_v"] = 2.0 * right / light.width_mm, 2.0 * up / light.length_mm
    elif isinstance(light, DirectionalLight):
        record["extent"] = np.tan(0.5 * np.radians(light.angle_degrees))
    elif isinstance(light, RectangleLight):
        _add_sides(record, 0.5 * light.width_mm, 0.5 * light.height_mm)
        record["irradiance"] /= facing_irradiance(light.width_mm, light.height_mm, distance)
    elif isinstance(light, SphereLight):
        _add_sides(record, light.radius_mm, light.radius_mm)
        record["irradiance"] /= np.pi * (light.radius_mm / distance) ** 2


def _add_sides(record: Any, half_width: float, half_height: float) -> None:
    right, up, _ = frame_of(record["direction"].astype(float), _UP)
    record["half_u"], record["half_v"] = half_width * right, half_height * up
    record["extent"] = half_width, half_height
