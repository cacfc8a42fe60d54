"""The scene's lights and environment as Mitsuba has them; places are in mm from the head's centre."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.environment.panorama import UNIFORM, load_panorama
from dermis.errors import refuse
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

Floats = NDArray[np.float64]
_FAR_MM = 2e5
"""Distance of what stands for parallel light: irradiance changes by 0.1 % in 100 mm, and single precision
places a stripe within 0.02 mm."""
_SPOT_SIDE = 1024
_STRIPE_REACH = 1.25  # widths to each side: there the Gaussian is 4e-6
_STRIPE_TEXELS = 40, 64  # least across a width and along the length
_MOST_STRIPE_TEXELS = 2**23


def emitter(mi: Any, light: Light, number: int) -> dict[str, Any]:
    """Mitsuba's description of a light.

    mi : the module, with a variant set
    number : the light's place in the scene, for messages

    Raises DermisError for a light without shadows: a path tracer has no such thing.
    """
    if not light.shadows:
        remedy = "Set shadows = true"
        refuse(f"light {number}", "a light with shadows, for path tracing", "it has shadows = false", remedy)
    if isinstance(light, StripeLight):
        return _stripe(mi, light, number)
    if isinstance(light, DirectionalLight):
        return _sun(mi, light) if light.angle_degrees > 0 else _parallel(light)
    if isinstance(light, SpotLight):
        return _spot(mi, light)
    if isinstance(light, RectangleLight):
        return _rectangle(mi, light)
    if isinstance(light, SphereLight):
        return _sphere(light)
    intensity = np.multiply(light.irradiance, _distance(light) ** 2)
    return {"type": "point", "position": list(light.position), "intensity": rgb(intensity)}


def surroundings(mi: Any, environment: Environment) -> dict[str, Any]:
    """Mitsuba's description of light from all around."""
    if environment.name == UNIFORM:
        return {"type": "constant", "radiance": rgb(np.full(3, environment.exposure))}
    panorama = environment.exposure * load_panorama(environment.name)
    angle = np.radians(environment.rotation_degrees)
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, 0, -sine], [0, 1, 0], [sine, 0, cosine]])
    # Mitsuba's pictures begin where ours have their middle.
    to_world = np.eye(4)
    to_world[:3, :3] = (np.diag([-1.0, 1.0, -1.0]) @ turn).T
    return {
        "type": "envmap",
        "bitmap": mi.Bitmap(_with_poles(panorama).astype(np.float32)),
        "to_world": mi.ScalarTransform4f(to_world),
    }


def rgb(values: Any) -> dict[str, Any]:
    """Three numbers, linear Rec. 709, as Mitsuba reads them."""
    return {"type": "rgb", "value": [float(value) for value in values]}


def facing_irradiance(width: float, height: float, distance: float) -> float:
    """Irradiance from a rectangle of radiance 1 on a surface opposite its middle [-].

    Source: the view factor of a corner, [Baum1989].
    """
    a, b = 0.5 * width / distance, 0.5 * height / distance
    across, along = np.hypot(1.0, a), np.hypot(1.0, b)
    return float(2.0 * (a / across * np.arctan(b / across) + b / along * np.arctan(a / along)))


def _distance(light: PointLight) -> float:
    return float(np.linalg.norm(np.subtract(light.target, light.position)))


def _looking(mi: Any, origin: Any, target: Any, up: Any = (0.0, 1.0, 0.0)) -> Any:
    """To world, with +Z from the origin to the target and Y upwards."""
    forward = np.subtract(target, origin)
    if np.linalg.norm(np.cross(forward, up)) < 1e-6 * np.linalg.norm(forward) * np.linalg.norm(up):
        up = (1.0, 0.0, 0.0)
    return mi.ScalarTransform4f().look_at(*([float(c) for c in v] for v in (origin, target, up)))


def _parallel(light: DirectionalLight) -> dict[str, Any]:
    return {"type": "directional", "direction": list(light.direction), "irradiance": rgb(light.irradiance)}


def _sun(mi: Any, light: DirectionalLight) -> dict[str, Any]:
    """A far disc as wide as the light's source."""
    direction = np.array(light.direction) / np.linalg.norm(light.direction)
    half = 0.5 * np.radians(light.angle_degrees)
    to_world = _looking(mi, -_FAR_MM * direction, (0.0, 0.0, 0.0)).scale(float(_FAR_MM * np.tan(half)))
    return _shining("disk", np.divide(light.irradiance, np.pi * np.sin(half) ** 2), to_world=to_world)


def _rectangle(mi: Any, light: RectangleLight) -> dict[str, Any]:
    sides = [0.5 * light.width_mm, 0.5 * light.height_mm, 1.0]
    to_world = _looking(mi, light.position, light.target).scale(sides)
    given = facing_irradiance(light.width_mm, light.height_mm, _distance(light))
    return _shining("rectangle", np.divide(light.irradiance, given), to_world=to_world)


def _sphere(light: SphereLight) -> dict[str, Any]:
    given = np.pi * (light.radius_mm / _distance(light)) ** 2
    return _shining(
        "sphere",
        np.divide(light.irradiance, given),
        center=[float(c) for c in light.position],
        radius=float(light.radius_mm),
    )


def _shining(kind: str, radiance: Any, **shape: Any) -> dict[str, Any]:
    """A shape that shines and is not there otherwise: it neither shadows nor reflects other light."""
    return {
        "type": kind,
        **shape,
        "bsdf": {"type": "null"},
        "emitter": {"type": "area", "radiance": rgb(radiance)},
    }


def _spot(mi: Any, light: SpotLight) -> dict[str, Any]:
    """A slide projector: Mitsuba's own spot fades evenly in the angle, ours smoothly in its cosine."""
    steepest = np.tan(np.radians(light.outer_degrees))
    along = steepest * ((np.arange(_SPOT_SIDE) + 0.5) / _SPOT_SIDE * 2.0 - 1.0)
    cosine = 1.0 / np.sqrt(1.0 + along[:, None] ** 2 + along[None, :] ** 2)
    outer, inner = (np.cos(np.radians(a)) for a in (light.outer_degrees, light.inner_degrees))
    share = _smoothstep((cosine - outer) / (inner - outer))
    slide = share[..., None] * np.multiply(light.irradiance, _distance(light) ** 2)
    return _projector(mi, slide, cosine, _looking(mi, light.position, light.target), steepest)


def _stripe(mi: Any, light: StripeLight, number: int) -> dict[str, Any]:
    """A far slide projector with the stripe as its slide."""
    width, length = light.width_mm, light.length_mm
    size = np.array([2.0 * _STRIPE_REACH * width, length])
    texel = min(width / _STRIPE_TEXELS[0], length / _STRIPE_TEXELS[1])
    texel = max(texel, float(np.sqrt(size.prod() / _MOST_STRIPE_TEXELS)))
    if width < 10.0 * texel:
        came = f"it is {length:g} mm long and {width:g} mm wide"
        refuse(f"light {number}", "a stripe less slender, for path tracing", came, "Shorten it")
    columns, rows = np.ceil(size / texel).astype(int)
    # The slide's texels are square: what the rounding adds is dark.
    across = ((np.arange(columns) + 0.5) - 0.5 * columns) * texel / (0.5 * width)
    along = ((np.arange(rows) + 0.5) - 0.5 * rows) * texel / (0.5 * length)
    with np.errstate(under="ignore"):
        profile = np.exp(-2.0 * across**2)
    share = (1.0 - _smoothstep((np.abs(along) - 0.95) / 0.05))[:, None] * profile[None, :]
    slide = share[..., None] * np.multiply(light.irradiance, _FAR_MM**2)
    direction = np.array(light.direction) / np.linalg.norm(light.direction)
    to_world = _looking(mi, light.position - _FAR_MM * direction, light.position, light.up)
    return _projector(mi, slide, np.ones((rows, columns)), to_world, 0.5 * columns * texel / _FAR_MM)


def _projector(
    mi: Any, intensity: Floats, cosine: Floats, to_world: Any, half_tangent: float
) -> dict[str, Any]:
    """What has an intensity (h, w, 3) through each texel of a slide [irradiance mm2].

    cosine : (h, w) of the angle from the axis
    half_tangent : of half the angle that the slide spans in x
    """
    # Mitsuba takes a slide for what falls on a plane across the axis, over pi.
    slide = intensity * cosine[..., None] ** 3 / np.pi
    return {
        "type": "projector",
        "to_world": to_world,
        "fov_axis": "x",
        "fov": float(2.0 * np.degrees(np.arctan(half_tangent))),
        "irradiance": {
            "type": "bitmap",
            "bitmap": mi.Bitmap(slide.astype(np.float32)),
            "raw": True,
            "filter_type": "bilinear",
            "wrap_mode": "clamp",
        },
    }


def _smoothstep(t: Floats) -> Floats:
    x = np.clip(t, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _with_poles(panorama: Floats) -> Floats:
    """(h + 1, w, 3) at the edges of the rows: Mitsuba has its first and its last row at the poles."""
    inside = 0.5 * (panorama[1:] + panorama[:-1])
    return np.concatenate((panorama[:1], inside, panorama[-1:]))
