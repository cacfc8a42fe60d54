"""A scene of ours described for Cycles: in its units, with its materials and its kinds of light."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.environment.panorama import UNIFORM, load_panorama
from dermis.errors import refuse
from dermis.mesh.head import Head
from dermis.optics.media import Medium
from dermis.reference.half_space import diffuse_albedo
from dermis.reference.mitsuba_lights import facing_irradiance
from dermis.reference.mitsuba_scene import Lambertian
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
_UNIT_MM = 100.0
"""Cycles' unit: a head is a few of them, as its sampling expects."""
_FAR_MM = 2e5
FALLOFFS = {"random-walk": "RANDOM_WALK", "burley": "BURLEY"}
"""Our names of Cycles' methods of subsurface scattering."""


def describe(
    scene: Scene, medium: Medium | Lambertian, method: str, size: tuple[int, int]
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """What goes into scene.json, less the passes, and the arrays beside it."""
    world, panorama = _world(scene.environment)
    described = {
        "materials": _materials(scene.head, medium, method),
        "lights": [_light(light, number) for number, light in enumerate(scene.lights, start=1)],
        "world": world,
        "camera": _camera(scene),
        "size": list(size),
        "direct": isinstance(medium, Lambertian),
    }
    mesh = scene.head.mesh
    arrays: dict[str, NDArray[Any]] = {
        "positions": ((mesh.positions - np.array(scene.head.centre_mm)) / _UNIT_MM).astype(np.float32),
        "normals": mesh.normals,
        "triangles": mesh.triangles,
        "material": mesh.material,
    }
    return described, arrays | panorama


def _materials(head: Head, medium: Medium | Lambertian, method: str) -> list[dict[str, Any]]:
    skin = _skin(medium, method)
    return [
        {"name": material.name, **(skin if material.kind == "skin" else _diffuse(material.colour))}
        for material in head.mesh.materials
    ]


def _diffuse(colour: Any) -> dict[str, Any]:
    return {"method": "DIFFUSE", "colour": [float(part) for part in colour]}


def _skin(medium: Medium | Lambertian, method: str) -> dict[str, Any]:
    """Colour: what a half-space of the medium reflects of diffuse light. Radius: 4 pi mean free paths.

    Cycles divides radii by 4 pi, and finds the walk's albedo from the colour by a fit whose inverse is
    `diffuse_albedo` within 1 %, so that its random walk is through this medium; but it enters and leaves as
    off a Lambertian surface. Its other method is the profile of [ChristensenBurley2015] for the same two. A
    ball under even light returns its colour within 3 % by the walk, within 0.5 % by the profile.
    """
    if isinstance(medium, Lambertian):
        return _diffuse(medium.albedo)
    if len(medium.layers) != 1:
        came = f"it has {len(medium.layers)}"
        refuse(medium.name, "one layer, for Cycles", came, "Take a medium of one layer, such as skin1")
    (layer,) = medium.layers
    radius = 4.0 * np.pi * layer.mean_free_path_mm / _UNIT_MM
    colour = [diffuse_albedo(float(alpha)) for alpha in layer.alpha_prime]
    return {"method": FALLOFFS[method], "colour": colour, "radius": radius.tolist()}


def _camera(scene: Scene) -> dict[str, Any]:
    camera = scene.camera
    path = np.subtract(camera.target, camera.position)
    return {
        "to_world": _looking(camera.position, path, camera.up),
        "half_tangent": 0.5 * camera.frame_mm / float(np.linalg.norm(path)),
    }


def _looking(place: Any, forward: Any, up: Any = (0.0, 1.0, 0.0)) -> list[list[float]]:
    """To world, for what looks along -Z with Y upwards."""
    right, above, ahead = _axes(forward, up)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([right, above, -ahead, np.asarray(place, np.float64) / _UNIT_MM])
    return [[float(value) for value in row] for row in matrix]


def _axes(forward: Any, up: Any) -> tuple[Floats, Floats, Floats]:
    ahead = np.asarray(forward, np.float64) / np.linalg.norm(forward)
    right = np.cross(ahead, up)
    if np.linalg.norm(right) < 1e-6 * np.linalg.norm(up):
        right = np.cross(ahead, (1.0, 0.0, 0.0))
    right /= np.linalg.norm(right)
    return right, np.cross(right, ahead), ahead


def _light(light: Light, number: int) -> dict[str, Any]:
    """Cycles' kind of light, its fields, and where it stands.

    Lights with a place have a power P: a point gives the irradiance P / 4 pi d^2, a surface A the radiance
    P / pi A.
    """
    if not light.shadows:
        remedy = "Set shadows = true"
        refuse(f"light {number}", "a light with shadows, for Cycles", "it has shadows = false", remedy)
    if isinstance(light, StripeLight):
        return _stripe(light)
    if isinstance(light, DirectionalLight):
        angle = float(np.radians(light.angle_degrees))
        return _placed("SUN", light.irradiance, 1.0, (0, 0, 0), light.direction, angle=angle)
    return _placed_light(light)


def _placed_light(light: PointLight) -> dict[str, Any]:
    path = np.subtract(light.target, light.position)
    distance = float(np.linalg.norm(path))
    if isinstance(light, RectangleLight):
        sides = light.width_mm / _UNIT_MM, light.height_mm / _UNIT_MM
        given = facing_irradiance(light.width_mm, light.height_mm, distance) / (np.pi * sides[0] * sides[1])
        shape = {"shape": "RECTANGLE", "size": sides[0], "size_y": sides[1]}
        return _placed("AREA", light.irradiance, 1.0 / given, light.position, path, **shape)
    power = 4.0 * np.pi * (distance / _UNIT_MM) ** 2
    radius = light.radius_mm / _UNIT_MM if isinstance(light, SphereLight) else 0.0
    round_light = {"shadow_soft_size": radius, "use_soft_falloff": False}
    if isinstance(light, SpotLight):
        inner, outer = (float(np.cos(np.radians(a))) for a in (light.inner_degrees, light.outer_degrees))
        cone = {
            "spot_size": 2.0 * np.radians(light.outer_degrees),
            "spot_blend": (inner - outer) / (1.0 - outer),
        }
        return _placed("SPOT", light.irradiance, power, light.position, path, **round_light, **cone)
    return _placed("POINT", light.irradiance, power, light.position, path, **round_light)


def _stripe(light: StripeLight) -> dict[str, Any]:
    across, along, forward = _axes(light.direction, light.up)
    power = 4.0 * np.pi * (_FAR_MM / _UNIT_MM) ** 2
    place = light.position - _FAR_MM * forward
    described = _placed("POINT", light.irradiance, power, place, light.direction, shadow_soft_size=0.0)
    axes = {
        "forward": (-forward).tolist(),
        "across": (across / (0.5 * light.width_mm)).tolist(),
        "along": (along / (0.5 * light.length_mm)).tolist(),
    }
    return described | {"stripe": {**axes, "distance": _FAR_MM}}


def _placed(
    kind: str, irradiance: Any, factor: float, place: Any, forward: Any, **given: Any
) -> dict[str, Any]:
    strength = float(max(irradiance))
    colour = [float(part) / strength for part in irradiance] if strength > 0.0 else [0.0, 0.0, 0.0]
    fields = {"color": colour, "energy": strength * float(factor), **given}
    fields = {
        name: float(value) if isinstance(value, np.floating) else value for name, value in fields.items()
    }
    return {"type": kind, "set": fields, "to_world": _looking(place, forward)}


def _world(environment: Environment | None) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    if environment is None:
        return {"strength": 0.0}, {}
    described: dict[str, Any] = {"strength": environment.exposure}
    if environment.name == UNIFORM:
        return described, {}
    angle = np.radians(environment.rotation_degrees)
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, 0, -sine], [0, 1, 0], [sine, 0, cosine]])
    # Cycles' panoramas have their middle at +X and their top at +Z; ours at -Z and +Y.
    described["turn"] = (_TO_CYCLES @ turn).tolist()
    return described, {"panorama": load_panorama(environment.name).astype(np.float32)}


_TO_CYCLES = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
