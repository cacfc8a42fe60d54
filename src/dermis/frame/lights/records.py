"""The scene's lights as the shaders read them, and their shadow views."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from itertools import count

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.environment.panorama import Sun
from dermis.frame.lights.kind import KINDS, Members, override_of
from dermis.frame.projection import (
    ShadowView,
    Triple,
    between,
    parallel_view,
    place_of,
    point_views,
    unit,
)
from dermis.gpu import ComputeProgram, Constants, Record
from dermis.mesh.outline import Outline
from dermis.scene.environment import Environment
from dermis.scene.lights import DirectionalLight, Light
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
_MOST_LIGHTS = 64
_WIDEST_SHADOW_FILTER = 6
_SIDE, _PART_SIDE = 4, 2  # an area light is shaded as SIDE x SIDE lights, each of several parts as fewer
_LINES, _LEAST_LINES, _SUN_LINES = 64, 12, 32  # shadow rays to an area light, fewest to a part, to a sun


def light_numbers() -> dict[str, float]:
    """Numbers that lights.wgsl and soft_shadows.wgsl fill in."""
    return {"most_lights": _MOST_LIGHTS, "most_lines": _LINES, "least_lines": _LEAST_LINES}


def sun_lights(suns: tuple[Sun, ...], environment: Environment) -> tuple[DirectionalLight, ...]:
    """The peaks of a panorama as lights, with its rotation and exposure."""
    angle = np.radians(environment.rotation_degrees)
    lights = []
    for sun in suns:
        x, y, z = -sun.direction
        lights.append(
            # Not checked: with the exposure it may be brighter than scene files allow.
            DirectionalLight.model_construct(
                direction=(np.cos(angle) * x + np.sin(angle) * z, y, np.cos(angle) * z - np.sin(angle) * x),
                irradiance=tuple(environment.exposure * sun.irradiance),
                angle_degrees=float(np.degrees(2.0 * sun.radius)),
                softness_mm=0.5,
            )
        )
    return tuple(lights)


def light_constants(scene: Scene) -> tuple[tuple[str, int], ...]:
    """Values of the `override`s of lighting.wgsl that the scene needs."""
    each = [(KINDS[light.kind], light) for light in scene.lights]
    called = sorted({light.kind for kind, light in each if not kind.always})
    named = {
        "SHAPES": any(kind.has_size(light) for kind, light in each),
        **dict.fromkeys(map(override_of, called), True),
        "ENVIRONMENT": scene.environment,
        "HALF_SPACE": scene.skin.direction != "lambertian",
    }
    return tuple((name, 1) for name, used in named.items() if used)


def oblique(constants: Constants) -> Constants:
    """Of passes that know how the surface goes on beside a point, which half-spaces ask for."""
    return (*constants, ("OBLIQUE", 1)) if ("HALF_SPACE", 1) in constants else constants


def light_parts(scene: Scene) -> tuple[int, ...]:
    """How many parts each light is shaded as."""
    return tuple(len(KINDS[light.kind].parts(light)) for light in scene.lights)


def light_views(scene: Scene, outline: Outline, size: int) -> list[ShadowView | None]:
    """The shadow view of each part of each light; None for those without shadows.

    outline : of the head's shape

    Raises DermisError for more lights than the shader holds, and for one inside the head's bounds.
    """
    numbered = [
        (f"light {number}", part)
        for number, light in enumerate(scene.lights, start=1)
        for part in KINDS[light.kind].parts(light)
    ]
    if len(numbered) > _MOST_LIGHTS:
        came = f"there are {len(numbered)}, with the environment's suns and each part of a large rectangle"
        refuse("lights", f"at most {_MOST_LIGHTS}", came, "Leave some out")
    head = scene.head
    for culprit, light in numbered:
        KINDS[light.kind].check(light, head, culprit)
    shadowed = [(culprit, light) for culprit, light in numbered if light.shadows]
    points = [(culprit, light) for culprit, light in shadowed if not isinstance(light, DirectionalLight)]
    found = iter(point_views(points, head.centre_mm, outline, size))

    def view(light: Light) -> ShadowView:
        if isinstance(light, DirectionalLight):
            return parallel_view(np.array(light.direction), outline, size)
        return next(found)

    return [view(light) if light.shadows else None for _, light in numbered]


def light_records(program: ComputeProgram, scene: Scene, views: list[ShadowView | None]) -> Record:
    """The shader's array of lights.

    views : one for each part of each light
    """
    record = program.record("Lights", place=places_on_lights())
    lights = record["light"]
    each = [KINDS[light.kind].parts(light) for light in scene.lights]
    divided = [(part, len(parts)) for parts in each for part in parts]
    none, layers = dict.fromkeys(lights.dtype.names or (), 0), count()
    made = []
    for (light, siblings), view in zip(divided, views, strict=True):
        members = _members(light, scene.head.centre_mm, view, siblings)
        one = {**none, **members, "layer": next(layers) if view else -1}
        made.append(tuple(one.values()))
    lights[: len(made)] = made  # at once: each access to a record takes as long as a light's arithmetic
    return record


@cache
def places_on_lights() -> Floats:
    """(64, 4) places spread evenly [Roberts2018] over a disc and over a square, both from -1 to 1."""
    even = (0.5 + np.arange(_LINES)[:, None] * [0.7548776662, 0.5698402910]) % 1.0
    phi = 2.0 * np.pi * even[:, 1]
    disc = np.sqrt(even[:, :1]) * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    return np.hstack([disc, 2.0 * even - 1.0])


def _members(light: Light, centre: Triple, view: ShadowView | None, siblings: int) -> Members:
    """A light's members in the shader's array, without those that are 0.

    siblings : how many parts its light has
    """
    kind, parallel = KINDS[light.kind], isinstance(light, DirectionalLight)
    distance, texel, place = 1.0, 1.0, (0.0, 0.0, 0.0)
    if isinstance(light, DirectionalLight):
        along: Sequence[float] = light.direction
    else:
        along, place = between(light.position, light.target), place_of(light.position, centre)
        distance = math.hypot(*along)
    seen: Members = {}
    if view:
        clip, texel, place, right, up, near, far = view
        seen = {"to_map": clip.T, "map_right": right, "map_up": up, "map_near": near, "map_far": far}
    half_width = round(0.5 * light.softness_mm / (texel * distance))
    return {
        "kind": KINDS.names.index(light.kind),
        "parallel": parallel,
        "round": kind.round,
        "narrow": kind.narrow,
        "sheet": kind.sheet,
        "irradiance": light.irradiance,
        "direction": unit(along),
        "position": place,
        "reference_mm": distance,
        "texel": texel if view else 0.0,
        # A tent of half width h fades over 2 h texels.
        "softness": 0.5 * light.softness_mm,
        "half_width": min(max(half_width, 1), _WIDEST_SHADOW_FILTER),
        "lines": _SUN_LINES if parallel else max(_LEAST_LINES, _LINES // siblings),
        "side": 1 if kind.narrow else _PART_SIDE if siblings > 1 else _SIDE,
        **seen,
        **kind.members(light, centre, distance),
    }
