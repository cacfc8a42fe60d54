"""The scene's lights as the shaders read them, and how each sees the head."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.environment.panorama import Sun
from dermis.errors import refuse
from dermis.frame.passes.variants import Constants
from dermis.frame.projection import (
    ShadowView,
    Triple,
    between,
    frame_of,
    parallel_view,
    place_of,
    point_views,
    unit,
)
from dermis.frame.rectangles import facing_irradiance, parts_of
from dermis.gpu import ComputeProgram
from dermis.mesh.head import Head
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


def light_constants(scene: Scene) -> Constants:
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
    head = scene.head
    for culprit, light in numbered:
        if isinstance(light, SphereLight):
            _check_outside(head, light, culprit)
    points = [(name, one) for name, one in numbered if one.shadows and isinstance(one, PointLight)]
    found = iter(point_views(points, head.centre_mm, head.mesh, size))

    def view(light: Light) -> ShadowView:
        if isinstance(light, DirectionalLight):
            return parallel_view(np.array(light.direction), head.mesh, size)
        return next(found)

    return [view(light) if light.shadows else None for _, light in numbered]


def _check_outside(head: Head, light: SphereLight, culprit: str) -> None:
    middle = place_of(light.position, head.centre_mm)
    near = float(np.linalg.norm(head.mesh.positions - np.array(middle), axis=1).min())
    if near <= light.radius_mm:
        came = f"the head is {near:.0f} mm from its middle"
        refuse(culprit, f"a head outside the sphere of {light.radius_mm:g} mm", came, "Move it away")


def light_records(program: ComputeProgram, scene: Scene, views: list[ShadowView | None]) -> Any:
    """The shader's array of lights.

    views : one for each part of each light
    """
    record = program.record("Lights", place=places_on_lights())
    lights = record["light"]
    divided = [(part, len(parts)) for parts in map(parts_of, scene.lights) for part in parts]
    none, layers = dict.fromkeys(lights.dtype.names or (), 0), count()
    made = []
    for (light, siblings), view in zip(divided, views, strict=True):
        few = isinstance(light, DirectionalLight)
        one = {
            **none,
            **_members(light, scene.head.centre_mm, view),
            "layer": next(layers) if view else -1,
            "lines": _SUN_LINES if few else max(_LEAST_LINES, _LINES // siblings),
            "side": _PART_SIDE if siblings > 1 else _SIDE,
        }
        made.append(tuple(one.values()))
    lights[: len(made)] = made  # at once: each place in a record takes as long as a light's arithmetic
    return record


@cache
def places_on_lights() -> Floats:
    """(64, 4) places spread evenly [Roberts2018] over a disc and over a square, both from -1 to 1."""
    even = (0.5 + np.arange(_LINES)[:, None] * [0.7548776662, 0.5698402910]) % 1.0
    phi = 2.0 * np.pi * even[:, 1]
    disc = np.sqrt(even[:, :1]) * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    return np.hstack([disc, 2.0 * even - 1.0])


def _members(light: Light, centre: Triple, view: ShadowView | None) -> dict[str, Any]:
    """A light's members in the shader's array, without those that are 0."""
    distance, texel, place = 1.0, 1.0, (0.0, 0.0, 0.0)
    if isinstance(light, DirectionalLight):
        along: Sequence[float] = light.direction
    else:
        along, place = between(light.position, light.target), place_of(light.position, centre)
        distance = math.hypot(*along)
    seen: dict[str, Any] = {}
    if view:
        clip, texel, place, right, up, near, far = view
        seen = {"to_map": clip.T, "map_right": right, "map_up": up, "map_near": near, "map_far": far}
    half_width = round(0.5 * light.softness_mm / (texel * distance))
    plain = {
        "kind": _KINDS.index(type(light)),
        "irradiance": light.irradiance,
        "direction": unit(along),
        "position": place,
        "reference_mm": distance,
        "texel": texel if view else 0.0,
        # A tent of half width h fades over 2 h texels.
        "softness": 0.5 * light.softness_mm,
        "half_width": min(max(half_width, 1), _WIDEST_SHADOW_FILTER),
    }
    return plain | seen | _shape(light, centre, distance)


def _shape(light: Light, centre: Triple, distance: float) -> dict[str, Any]:
    """What only some kinds have: a cone, a stripe, or a size; lights of some size carry their radiance."""
    if isinstance(light, SpotLight):
        inner, outer = math.radians(light.inner_degrees), math.radians(light.outer_degrees)
        return {"cos_inner": math.cos(inner), "cos_outer": math.cos(outer)}
    if isinstance(light, StripeLight):
        right, up, _ = frame_of(np.array(light.direction), np.array(light.up))
        across, along = 2.0 * right / light.width_mm, 2.0 * up / light.length_mm
        return {"position": place_of(light.position, centre), "half_u": across, "half_v": along}
    if isinstance(light, DirectionalLight):
        return {"extent": math.tan(0.5 * math.radians(light.angle_degrees))}
    if isinstance(light, RectangleLight):
        radiance = 1.0 / facing_irradiance(light.width_mm, light.height_mm, distance)
        return _sided(light, radiance, 0.5 * light.width_mm, 0.5 * light.height_mm)
    if isinstance(light, SphereLight):
        radiance = 1.0 / (math.pi * (light.radius_mm / distance) ** 2)
        return _sided(light, radiance, light.radius_mm, light.radius_mm)
    return {}


def _sided(light: PointLight, radiance: float, half_width: float, half_height: float) -> dict[str, Any]:
    """radiance : for an irradiance of 1"""
    right, up, _ = frame_of(np.array(between(light.position, light.target)), _UP)
    return {
        "half_u": half_width * right,
        "half_v": half_height * up,
        "extent": (half_width, half_height),
        "irradiance": radiance * np.array(light.irradiance),
    }
