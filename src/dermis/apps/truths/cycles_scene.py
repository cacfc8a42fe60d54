"""A scene of ours described for Cycles: in its units, with its materials and its kinds of light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.described import UNIT_MM, check_lens, cycles_looking, world
from dermis.apps.truths.half_space import diffuse_albedo
from dermis.apps.truths.lights import lamp
from dermis.apps.truths.mitsuba_scene import Lambertian
from dermis.base.errors import refuse
from dermis.mesh.head import Head
from dermis.optics.media import Medium
from dermis.scene.model import Scene
from dermis.specular.fresnel import SKIN_ETA


@dataclass(frozen=True)
class Facets:
    """A surface alone, over black: a boundary of index 1.4 cut into Beckmann's facets.

    The head's normal map is on it.

    roughness : Beckmann's m [-]
    """

    roughness: float


@dataclass(frozen=True, eq=False)
class Coated:
    """Skin as a Blender user makes it: Principled, a random walk under a rough boundary of index 1.4.

    The head's normal map is on it. Cycles has GGX's facets there; what they reflect does not enter.

    colour : (h, w, 3) of the light that comes back from below, linear Rec. 709 [-]
    radius_mm : (3,) Cycles' radius, 4 pi mean free paths [mm]
    roughness : m [-]
    """

    colour: NDArray[np.float32]
    radius_mm: tuple[float, float, float]
    roughness: float


Below = Medium | Lambertian | Facets | Coated
FALLOFFS = {"random-walk": "RANDOM_WALK", "burley": "BURLEY"}
"""Our names of Cycles' methods of subsurface scattering."""


def describe(
    scene: Scene, medium: Below, method: str, size: tuple[int, int]
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """What goes into scene.json, less the passes, and the arrays beside it."""
    around, panorama = world(scene.environment)
    described = {
        "materials": _materials(scene.head, medium, method),
        "lights": [lamp(light, number) for number, light in enumerate(scene.lights, start=1)],
        "world": around,
        "camera": camera_of(scene),
        "size": list(size),
        "direct": isinstance(medium, Lambertian | Facets),
    }
    mesh = scene.head.mesh
    arrays: dict[str, NDArray[Any]] = {
        "positions": ((mesh.positions - np.array(scene.head.centre_mm)) / UNIT_MM).astype(np.float32),
        "normals": mesh.normals,
        "triangles": mesh.triangles,
        "material": mesh.material,
    }
    if isinstance(medium, Facets | Coated) and scene.head.maps.normal is not None:
        arrays |= {"uv": mesh.uv, "normal_map": _normal_map(scene.head.maps.normal)}
    if isinstance(medium, Coated):
        arrays |= {"uv": mesh.uv, "colour_map": medium.colour}
    return described, arrays | panorama


def _normal_map(slopes: NDArray[np.float32]) -> NDArray[np.float32]:
    """(h, w, 3) normals in tangent space as colours, of slopes (h, w, 2)."""
    normal = np.dstack([-slopes, np.ones(slopes.shape[:2], np.float32)])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return np.asarray(0.5 + 0.5 * normal, np.float32)


def _materials(head: Head, medium: Below, method: str) -> list[dict[str, Any]]:
    skin = _skin(medium, method)
    return [
        {"name": material.name, **(skin if material.kind == "skin" else _diffuse(material.colour))}
        for material in head.mesh.materials
    ]


def _diffuse(colour: Any) -> dict[str, Any]:
    return {"method": "DIFFUSE", "colour": [float(part) for part in colour]}


def _skin(medium: Below, method: str) -> dict[str, Any]:
    """Colour: what a half-space of the medium reflects of diffuse light. Radius: 4 pi mean free paths.

    Cycles divides radii by 4 pi, and finds the walk's albedo from the colour by a fit whose inverse is
    `diffuse_albedo` within 1 %, so that its random walk is through this medium; but it enters and leaves as
    off a Lambertian surface. Its other method is the profile of [ChristensenBurley2015] for the same two. A
    ball under even light returns its colour within 3 % by the walk, within 0.5 % by the profile.
    """
    if isinstance(medium, Lambertian):
        return _diffuse(medium.albedo)
    if isinstance(medium, Facets):
        # Blender's number is the root of Beckmann's
        return {"method": "FACETS", "roughness": float(np.sqrt(medium.roughness)), "ior": SKIN_ETA}
    if isinstance(medium, Coated):
        radius = [part / UNIT_MM for part in medium.radius_mm]
        return {
            "method": "COATED",
            "roughness": float(np.sqrt(medium.roughness)),
            "ior": SKIN_ETA,
            "radius": radius,
        }
    if len(medium.layers) != 1:
        came = f"it has {len(medium.layers)}"
        refuse(medium.name, "one layer, for Cycles", came, "Take a medium of one layer, such as skin1")
    (layer,) = medium.layers
    walk = 4.0 * np.pi * layer.mean_free_path_mm / UNIT_MM
    colour = [diffuse_albedo(float(alpha)) for alpha in layer.alpha_prime]
    return {"method": FALLOFFS[method], "colour": colour, "radius": walk.tolist()}


def camera_of(scene: Scene) -> dict[str, Any]:
    """The camera in Cycles' units.

    Raises DermisError for lenses that Cycles has not.
    """
    camera = scene.camera
    check_lens(camera, "Cycles")
    path = np.subtract(camera.target, camera.position)
    return {
        "to_world": cycles_looking(camera.position, path, camera.up),
        "half_tangent": camera.half_tangent,
    }
