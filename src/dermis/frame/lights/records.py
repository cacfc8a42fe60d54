"""Uniform records of the scene's lights, and the views of their shadow maps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from itertools import count
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.environment.panorama import Sun
from dermis.frame.lights.kind import KINDS, StructMembers, kind_constant_name
from dermis.frame.projection import (
    ShadowView,
    Triple,
    parallel_shadow_view,
    point_shadow_views,
    unit_vector,
    vector_between,
    world_position,
)
from dermis.gpu import ComputeProgram, Constants, UniformRecord
from dermis.mesh.outline import Outline
from dermis.scene.environment import Environment
from dermis.scene.lights import DirectionalLight, Light
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
_MAX_LIGHTS = 64
_MAX_SHADOW_FILTER_TEXELS = 6  # largest half width of a shadow filter [shadow texels]
_PART_SAMPLES_PER_SIDE = 2  # each of several parts of a light is sampled by 2 x 2 points
_MAX_SHADOW_RAY_COUNT = 64
_MIN_SHADOW_RAY_COUNT = 12  # least number of shadow rays to a part of a light
_SUN_SHADOW_RAY_COUNT = 32  # shadow rays to a sun


class _LightSampling(NamedTuple):
    """Sampling of area lights that are not divided.

    points_per_side : square root of the number of points at which the light itself is sampled
    shadow_ray_count : number of shadow rays
    """

    points_per_side: int
    shadow_ray_count: int


_GPU_SAMPLING = _LightSampling(4, _MAX_SHADOW_RAY_COUNT)
_SOFTWARE_SAMPLING = _LightSampling(2, 16)
_FIRST_SAMPLE_POINT = 2016  # with it, the first 12, 16, 32 and 64 points have nearly the variance of a square


def light_shader_constants() -> dict[str, float]:
    """Return the named values that `//#fill` lines insert into lights.wgsl."""
    return {"max_lights": _MAX_LIGHTS, "max_rays": _MAX_SHADOW_RAY_COUNT}


def sun_lights(suns: tuple[Sun, ...], environment: Environment) -> tuple[DirectionalLight, ...]:
    """Return the suns of a panorama as parallel lights, rotated and exposed like their environment."""
    angle = np.radians(environment.rotation_degrees)
    lights = []
    for sun in suns:
        x, y, z = -sun.direction
        lights.append(
            # not validated: with the exposure it may exceed the limits of scene files
            DirectionalLight.model_construct(
                direction=(np.cos(angle) * x + np.sin(angle) * z, y, np.cos(angle) * z - np.sin(angle) * x),
                irradiance=tuple(environment.exposure * sun.irradiance),
                angle_degrees=float(np.degrees(2.0 * sun.radius)),
                softness_mm=0.5,
            )
        )
    return tuple(lights)


def light_constants(scene: Scene) -> tuple[tuple[str, int], ...]:
    """Return the pipeline constants of lighting.wgsl that a scene's lights and skin need."""
    each = [(KINDS[light.kind], light) for light in scene.lights]
    used_kinds = sorted({light.kind for kind, light in each if not kind.always})
    flags = {
        "SHAPES": any(kind.has_penumbra(light) for kind, light in each),
        **dict.fromkeys(map(kind_constant_name, used_kinds), True),
        "ENVIRONMENT": scene.environment,
        "HALF_SPACE": scene.skin.direction != "lambertian",
    }
    return tuple((name, 1) for name, value in flags.items() if value)


def with_oblique_incidence_constant(constants: Constants) -> Constants:
    """Return `constants`, with OBLIQUE added if they contain HALF_SPACE.

    HALF_SPACE makes the response of skin to light depend on direction. OBLIQUE adds a further effect: the
    light that leaves around a point has entered the skin a short distance away, towards the light source.
    With OBLIQUE, the incident light is therefore evaluated where it enters instead of at the point.
    Only passes that provide the shape of the surface around a point may use OBLIQUE.
    """
    return (*constants, ("OBLIQUE", 1)) if ("HALF_SPACE", 1) in constants else constants


def light_part_counts(scene: Scene) -> tuple[int, ...]:
    """Return the number of parts into which each light is divided.

    Large rectangular lights are divided into several parts, each with its own shadow map; for all other
    lights the number is 1.
    """
    return tuple(len(KINDS[light.kind].light_parts(light)) for light in scene.lights)


def light_shadow_views(scene: Scene, outline: Outline, map_side: int) -> list[ShadowView | None]:
    """Return the views of the shadow maps: one for each part of each light, None if the light has no shadows.

    outline : outline of the head's shape
    map_side : side of the shadow maps [texels]

    Raises DermisError for more lights than the shader supports, and for a light inside the bounds of the
    head.
    """
    numbered = [
        (f"light {number}", part)
        for number, light in enumerate(scene.lights, start=1)
        for part in KINDS[light.kind].light_parts(light)
    ]
    if len(numbered) > _MAX_LIGHTS:
        actual = f"there are {len(numbered)}, with the environment's suns and each part of a large rectangle"
        refuse("lights", f"at most {_MAX_LIGHTS}", actual, "Remove some")
    head = scene.head
    for light_label, light in numbered:
        KINDS[light.kind].check(light, head, light_label)
    shadowed = [(light_label, light) for light_label, light in numbered if light.shadows]
    points = [
        (light_label, light) for light_label, light in shadowed if not isinstance(light, DirectionalLight)
    ]
    point_views = iter(point_shadow_views(points, head.centre_mm, outline, map_side))

    def shadow_view(light: Light) -> ShadowView:
        if isinstance(light, DirectionalLight):
            return parallel_shadow_view(np.array(light.direction), outline, map_side)
        return next(point_views)

    return [shadow_view(light) if light.shadows else None for _, light in numbered]


def light_records(
    shading_program: ComputeProgram, scene: Scene, shadow_views: list[ShadowView | None]
) -> UniformRecord:
    """Return the uniform record `Lights` of all lights of the scene.

    shading_program : program of the shading pass, which declares the record
    shadow_views : result of `light_shadow_views`
    """
    record = shading_program.make_record("Lights", sample_points=light_sample_points())
    lights = record["light"]
    each = [KINDS[light.kind].light_parts(light) for light in scene.lights]
    divided = [(part, len(parts)) for parts in each for part in parts]
    none, layers = dict.fromkeys(lights.dtype.names or (), 0), count()
    sampling = _SOFTWARE_SAMPLING if shading_program.device.adapter.kind == "CPU" else _GPU_SAMPLING
    rows = []
    for (light, siblings), view in zip(divided, shadow_views, strict=True):
        members = _light_members(light, scene.head.centre_mm, view, siblings, sampling)
        one = {**none, **members, "layer": next(layers) if view else -1}
        rows.append(tuple(one.values()))
    lights[: len(rows)] = rows  # in one assignment, as each access to a record is slow
    return record


@cache
def light_sample_points() -> Floats:
    """Return (64, 4) evenly spread sample points of area lights [Roberts2018].

    A row holds two points: x and y on the unit disc, then x and y on the square from -1 to 1. Points come in
    opposite pairs, so that the mean of the first n points is the centre of the light for every even n.
    """
    pairs = _FIRST_SAMPLE_POINT + np.arange(_MAX_SHADOW_RAY_COUNT // 2)
    even = (0.5 + pairs[:, None] * [0.7548776662, 0.5698402910]) % 1.0
    phi = 2.0 * np.pi * even[:, 1]
    disc = np.sqrt(even[:, :1]) * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    half = np.hstack([disc, 2.0 * even - 1.0])
    return np.stack([half, -half], axis=1).reshape(_MAX_SHADOW_RAY_COUNT, 4)


def _light_members(
    light: Light,
    centre: Triple,
    shadow_view: ShadowView | None,
    part_count: int,
    sampling: _LightSampling,
) -> StructMembers:
    """Return the members of the shader struct `Light` for a light; members that are left out are 0.

    light : light, or one part of a divided light
    centre : centre of the head, the origin of light positions [mm]
    shadow_view : view for the light's shadow map, None if the light has no shadows
    part_count : number of parts of the light, 1 if it is not divided
    sampling : sampling of area lights on this adapter
    """
    kind, parallel = KINDS[light.kind], isinstance(light, DirectionalLight)
    distance, texel, position = 1.0, 1.0, (0.0, 0.0, 0.0)
    if isinstance(light, DirectionalLight):
        along: Sequence[float] = light.direction
    else:
        along, position = vector_between(light.position, light.target), world_position(light.position, centre)
        distance = math.hypot(*along)
    shadow: StructMembers = {}
    if shadow_view:
        clip, texel, position, right, up, near, far = shadow_view
        shadow = {"to_map": clip.T, "map_right": right, "map_up": up, "map_near": near, "map_far": far}
    half_width = round(0.5 * light.softness_mm / (texel * distance))
    return {
        "kind": KINDS.names.index(light.kind),
        "parallel": parallel,
        "round": kind.round,
        "punctual": kind.punctual,
        "sheet": kind.sheet,
        "irradiance": light.irradiance,
        "direction": unit_vector(along),
        "position": position,
        "reference_mm": distance,
        "texel": texel if shadow_view else 0.0,
        # a tent of half width h fades over 2 h texels
        "softness": 0.5 * light.softness_mm,
        "half_width": min(max(half_width, 1), _MAX_SHADOW_FILTER_TEXELS),
        "rays": _SUN_SHADOW_RAY_COUNT
        if parallel
        else max(_MIN_SHADOW_RAY_COUNT, sampling.shadow_ray_count // part_count),
        "side": 1
        if kind.punctual
        else _PART_SAMPLES_PER_SIDE
        if part_count > 1
        else sampling.points_per_side,
        **shadow,
        **kind.shader_members(light, centre, distance),
    }
