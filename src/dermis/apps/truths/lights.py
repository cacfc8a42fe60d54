"""Conversion of a scene's lights for Mitsuba and Cycles; positions are in mm from the head's centre."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.scene_description import (
    CYCLES_UNIT_MM,
    Mitsuba,
    SceneDict,
    camera_axes,
    cycles_light,
    mitsuba_look_at,
    mitsuba_projector,
    mitsuba_rgb,
    mitsuba_shape,
)
from dermis.base.errors import refuse
from dermis.base.registry import Registry
from dermis.base.renamed import successor
from dermis.scene.lights import (
    DirectionalLight,
    Light,
    PointLight,
    RectangleLight,
    SphereLight,
    SpotLight,
    StripeLight,
)

Floats = NDArray[np.float64]
_DISTANT_LIGHT_DISTANCE_MM = 2e5
"""Distance of the source of nearly parallel light: irradiance changes by 0.1 % in 100 mm, and a stripe is
positioned within 0.02 mm in single precision."""
_SPOT_TEXTURE_SIDE = 1024
_STRIPE_TEXTURE_HALF_WIDTHS = 1.25  # in widths; the Gaussian is 4e-6 there
_MIN_STRIPE_TEXELS = 40, 64  # smallest numbers of texels across a width and along the length
_MAX_STRIPE_TEXELS = 2**23


def mitsuba_emitter(mi: Mitsuba, light: Light, light_number: int) -> SceneDict:
    """Return Mitsuba's description of a light.

    mi : module `mitsuba` with a variant set
    light_number : number of the light in the scene, counted from 1, for error messages

    Raises DermisError for a light without shadows, which a path tracer does not support, and for a kind of
    light that this module does not convert.
    """
    _check_shadows(light, light_number, "path tracing")
    return MITSUBA_LIGHTS[light.kind](mi, light, f"light {light_number}")


def cycles_lamp(light: Light, light_number: int) -> SceneDict:
    """Return Cycles' description of a light, in Cycles' units.

    light_number : number of the light in the scene, counted from 1, for error messages
    """
    _check_shadows(light, light_number, "Cycles")
    return CYCLES_LIGHTS[light.kind](light)


def _check_shadows(light: Light, light_number: int, renderer: str) -> None:
    if not light.shadows:
        advice = "Set shadows = true"
        refuse(
            f"light {light_number}", f"a light with shadows, for {renderer}", "it has shadows = false", advice
        )


def mitsuba_point(mi: Mitsuba, light: PointLight, light_label: str) -> SceneDict:
    """Return Mitsuba's description of a point light."""
    intensity = np.multiply(light.irradiance, _target_distance_mm(light) ** 2)
    return {"type": "point", "position": list(light.position), "intensity": mitsuba_rgb(intensity)}


def mitsuba_spot(mi: Mitsuba, light: SpotLight, light_label: str) -> SceneDict:
    """Return a Mitsuba projector in place of a spot light; Mitsuba's own spot light has no smooth edge."""
    tangent = np.tan(np.radians(light.outer_degrees))
    along = tangent * ((np.arange(_SPOT_TEXTURE_SIDE) + 0.5) / _SPOT_TEXTURE_SIDE * 2.0 - 1.0)
    cosine = 1.0 / np.sqrt(1.0 + along[:, None] ** 2 + along[None, :] ** 2)
    outer, inner = (np.cos(np.radians(a)) for a in (light.outer_degrees, light.inner_degrees))
    falloff = _smoothstep((cosine - outer) / (inner - outer))
    slide = falloff[..., None] * np.multiply(light.irradiance, _target_distance_mm(light) ** 2)
    return mitsuba_projector(mi, slide, cosine, mitsuba_look_at(mi, light.position, light.target), tangent)


def mitsuba_rectangle(mi: Mitsuba, light: RectangleLight, light_label: str) -> SceneDict:
    """Return Mitsuba's description of a rectangle light: a rectangle of uniform radiance."""
    sides = [0.5 * light.width_mm, 0.5 * light.height_mm, 1.0]
    to_world = mitsuba_look_at(mi, light.position, light.target).scale(sides)
    unit_irradiance = facing_irradiance(light.width_mm, light.height_mm, _target_distance_mm(light))
    return mitsuba_shape("rectangle", np.divide(light.irradiance, unit_irradiance), to_world=to_world)


def mitsuba_sphere(mi: Mitsuba, light: SphereLight, light_label: str) -> SceneDict:
    """Return Mitsuba's description of a sphere light: a sphere of uniform radiance."""
    unit_irradiance = np.pi * (light.radius_mm / _target_distance_mm(light)) ** 2
    return mitsuba_shape(
        "sphere",
        np.divide(light.irradiance, unit_irradiance),
        center=[float(c) for c in light.position],
        radius=float(light.radius_mm),
    )


def mitsuba_directional(mi: Mitsuba, light: DirectionalLight, light_label: str) -> SceneDict:
    """Return Mitsuba's directional light, or a distant disc for a light with an angular diameter."""
    if light.angle_degrees == 0:
        irradiance = mitsuba_rgb(light.irradiance)
        return {"type": "directional", "direction": list(light.direction), "irradiance": irradiance}
    direction = np.array(light.direction) / np.linalg.norm(light.direction)
    half = 0.5 * np.radians(light.angle_degrees)
    to_world = mitsuba_look_at(mi, -_DISTANT_LIGHT_DISTANCE_MM * direction, (0.0, 0.0, 0.0)).scale(
        float(_DISTANT_LIGHT_DISTANCE_MM * np.tan(half))
    )
    return mitsuba_shape("disk", np.divide(light.irradiance, np.pi * np.sin(half) ** 2), to_world=to_world)


def mitsuba_stripe(mi: Mitsuba, light: StripeLight, light_label: str) -> SceneDict:
    """Return Mitsuba's description of a stripe light: a distant slide projector whose slide is the stripe.

    light_label : name of the light in error messages
    """
    width, length = light.width_mm, light.length_mm
    size = np.array([2.0 * _STRIPE_TEXTURE_HALF_WIDTHS * width, length])
    texel = min(width / _MIN_STRIPE_TEXELS[0], length / _MIN_STRIPE_TEXELS[1])
    texel = max(texel, float(np.sqrt(size.prod() / _MAX_STRIPE_TEXELS)))
    if width < 10.0 * texel:
        actual = f"it is {length:g} mm long and {width:g} mm wide"
        refuse(light_label, "a stripe less slender, for path tracing", actual, "Shorten it")
    columns, rows = np.ceil(size / texel).astype(int)
    # The slide's texels are square; those added by rounding up are dark.
    across = ((np.arange(columns) + 0.5) - 0.5 * columns) * texel / (0.5 * width)
    along = ((np.arange(rows) + 0.5) - 0.5 * rows) * texel / (0.5 * length)
    with np.errstate(under="ignore"):
        profile = np.exp(-2.0 * across**2)
    falloff = (1.0 - _smoothstep((np.abs(along) - 0.95) / 0.05))[:, None] * profile[None, :]
    slide = falloff[..., None] * np.multiply(light.irradiance, _DISTANT_LIGHT_DISTANCE_MM**2)
    direction = np.array(light.direction) / np.linalg.norm(light.direction)
    to_world = mitsuba_look_at(
        mi, light.position - _DISTANT_LIGHT_DISTANCE_MM * direction, light.position, light.up
    )
    return mitsuba_projector(
        mi, slide, np.ones((rows, columns)), to_world, 0.5 * columns * texel / _DISTANT_LIGHT_DISTANCE_MM
    )


def cycles_point(light: PointLight) -> SceneDict:
    """Return Cycles' point light; its power P gives the irradiance P / (4 pi d^2) at the distance d."""
    return _cycles_point_light("POINT", light)


def cycles_spot(light: SpotLight) -> SceneDict:
    """Return Cycles' spot light; its intensity falls off smoothly at the edge of the cone, as in dermis."""
    inner, outer = (float(np.cos(np.radians(a))) for a in (light.inner_degrees, light.outer_degrees))
    size, blend = 2.0 * np.radians(light.outer_degrees), (inner - outer) / (1.0 - outer)
    return _cycles_point_light("SPOT", light, spot_size=size, spot_blend=blend)


def cycles_sphere(light: SphereLight) -> SceneDict:
    """Return Cycles' description of a sphere light: a point light with a radius."""
    return _cycles_point_light("POINT", light, radius_mm=light.radius_mm)


def cycles_rectangle(light: RectangleLight) -> SceneDict:
    """Return Cycles' area light; its power P gives the radiance P / (pi A) on its area A."""
    width, height = light.width_mm / CYCLES_UNIT_MM, light.height_mm / CYCLES_UNIT_MM
    unit_irradiance = facing_irradiance(light.width_mm, light.height_mm, _target_distance_mm(light)) / (
        np.pi * width * height
    )
    to_target = np.subtract(light.target, light.position)
    shape: dict[str, float | str] = {"shape": "RECTANGLE", "size": width, "size_y": height}
    return cycles_light("AREA", light.irradiance, 1.0 / unit_irradiance, light.position, to_target, **shape)


def cycles_directional(light: DirectionalLight) -> SceneDict:
    """Return Cycles' description of a directional light: a sun lamp with the same angular diameter."""
    angle = float(np.radians(light.angle_degrees))
    return cycles_light("SUN", light.irradiance, 1.0, (0, 0, 0), light.direction, angle=angle)


def cycles_stripe(light: StripeLight) -> SceneDict:
    """Return a distant point light, which cycles_script.py turns into a stripe light by shader nodes."""
    across, along, forward = camera_axes(light.direction, light.up)
    power = 4.0 * np.pi * (_DISTANT_LIGHT_DISTANCE_MM / CYCLES_UNIT_MM) ** 2
    source = light.position - _DISTANT_LIGHT_DISTANCE_MM * forward
    distant = cycles_light("POINT", light.irradiance, power, source, light.direction, shadow_soft_size=0.0)
    axes = {
        "forward": (-forward).tolist(),
        "across": (across / (0.5 * light.width_mm)).tolist(),
        "along": (along / (0.5 * light.length_mm)).tolist(),
    }
    return distant | {"stripe": {**axes, "distance": _DISTANT_LIGHT_DISTANCE_MM}}


def _cycles_point_light(
    lamp_type: str, light: PointLight, *, radius_mm: float = 0.0, **fields: float
) -> SceneDict:
    power = 4.0 * np.pi * (_target_distance_mm(light) / CYCLES_UNIT_MM) ** 2
    to_target = np.subtract(light.target, light.position)
    round_light = {"shadow_soft_size": radius_mm / CYCLES_UNIT_MM, "use_soft_falloff": False}
    return cycles_light(
        lamp_type, light.irradiance, power, light.position, to_target, **round_light, **fields
    )


def facing_irradiance(width: float, height: float, distance: float) -> float:
    """Return the irradiance that a rectangle of radiance 1 causes on a parallel surface facing its centre.

    width, height : size of the rectangle
    distance : distance between rectangle and surface, in the same unit as the size

    Source: view factor from a corner, [Baum1989].
    """
    a, b = 0.5 * width / distance, 0.5 * height / distance
    across, along = np.hypot(1.0, a), np.hypot(1.0, b)
    return float(2.0 * (a / across * np.arctan(b / across) + b / along * np.arctan(a / along)))


def _target_distance_mm(light: PointLight) -> float:
    return float(np.linalg.norm(np.subtract(light.target, light.position)))


def _smoothstep(fraction: Floats) -> Floats:
    x = np.clip(fraction, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


# Any, because each function has a parameter of its own kind of light.
MITSUBA_LIGHTS: Registry[Callable[[Mitsuba, Any, str], SceneDict]] = Registry(
    "light of Mitsuba",
    {
        "point": mitsuba_point,
        "spot": mitsuba_spot,
        "rectangle": mitsuba_rectangle,
        "sphere": mitsuba_sphere,
        "directional": mitsuba_directional,
        "stripe": mitsuba_stripe,
    },
    f"Leave the light out, or register in {__name__}.MITSUBA_LIGHTS its replacement",
)
"""Functions that describe a light for Mitsuba, by kind of light. Their arguments are the module `mitsuba`
with a variant set, the light, and its name for messages."""

CYCLES_LIGHTS: Registry[Callable[[Any], SceneDict]] = Registry(
    "light of Cycles",
    {
        "point": cycles_point,
        "spot": cycles_spot,
        "rectangle": cycles_rectangle,
        "sphere": cycles_sphere,
        "directional": cycles_directional,
        "stripe": cycles_stripe,
    },
    f"Leave the light out, or register in {__name__}.CYCLES_LIGHTS its replacement",
)
"""Functions that describe a light for Cycles (type, fields and transform), by kind of light."""


def __getattr__(name: str) -> Any:
    """Return an object of this module by the name that it had in the last release, for compatibility."""
    if new := successor(__name__, name):
        return globals()[new]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
