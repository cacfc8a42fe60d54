"""Scene of Mitsuba as files: `mitsuba scene.xml` renders it, `-D boundary=rough` under another surface."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Literal, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.scene_parts import known_lights
from dermis.apps.export.targets.maps import exr
from dermis.apps.export.targets.mitsuba.meshes import surfaces
from dermis.apps.export.targets.mitsuba.xml import (
    Given,
    Ref,
    Words,
    default,
    document,
    element,
    include,
    picture_file,
)
from dermis.apps.truths.scene_description import SceneDict, rgb, mitsuba_environment
from dermis.apps.truths.lights import MITSUBA, mitsuba_emitter
from dermis.apps.truths.mitsuba_scene import ROULETTE_DEPTH, mitsuba_sensor
from dermis.scene.model import Scene
from dermis.specular.fresnel import SKIN_ETA

Floats = NDArray[np.float32]
Boundary = Literal["matched", "smooth", "rough"]
BOUNDARIES: Mapping[Boundary, float] = {"matched": 1.0, "smooth": SKIN_ETA, "rough": SKIN_ETA}
"""Surfaces of the skin and their index of refraction."""
REFLECTED = 0.03
"""Share of the light that a matched surface reflects, from all directions alike: that of rough skin."""
_WET = 0.3  # the square root of Beckmann's m


class Walked(NamedTuple):
    """A medium of isotropic scattering.

    sigma_t : (3,) extinction [1/mm]
    albedo : (3,) of one scattering [-]
    """

    sigma_t: tuple[float, ...]
    albedo: tuple[float, ...]


class Looks(NamedTuple):
    """Medium and surface of the skin.

    media : of each boundary
    roughness : Beckmann m, one number or (n, n)
    passing : (n, n, 3) share that a refracting surface lets pass each way, of skin that differs from place to
        place; None for skin that is alike everywhere
    held_back : (n, n) share that a matched surface keeps of what leaves, as it has no colours
    opaque : files of other materials, by their indices
    """

    media: Mapping[Boundary, Walked]
    roughness: float | Floats
    passing: Floats | None = None
    held_back: Floats | None = None
    opaque: Mapping[int, bytes] = MappingProxyType({})


def scene_files(
    scene: Scene, looks: Looks, boundary: Boundary, size: tuple[int, int], samples: int
) -> Iterator[tuple[str, bytes]]:
    """Return names and contents of the files, the scene first.

    Raises DermisError for what Mitsuba has no words for: lights without shadows, cameras with shifted lenses,
    skin that encloses no volume.
    """
    words = Words()
    made = surfaces(words, scene.head)
    yield "scene.xml", document(_frame(words, scene, looks, boundary, (*size, samples)))
    for each in BOUNDARIES:
        yield f"boundary_{each}.xml", document(_skin(words, each, looks, made))
    yield from ((f"meshes/{name}.ply", content) for name, content in made.items())
    for index, content in looks.opaque.items():
        yield _opaque_file(index), content
    if looks.passing is not None and looks.held_back is not None:
        yield "textures/passing.exr", exr("passing", looks.passing)
        yield "textures/held_back.exr", exr("held_back", looks.held_back)
    if not isinstance(looks.roughness, float):
        yield "textures/roughness.exr", exr("roughness", looks.roughness)
    for index, values in enumerate(words.bitmaps):
        yield picture_file(index), exr("light", np.asarray(values, np.float32))


def medium_words(medium: Walked) -> SceneDict:
    """Return a homogeneous medium [mm]; colours are at most 1, the largest extinction is the scale."""
    extinction = np.asarray(medium.sigma_t)
    return {
        "type": "homogeneous",
        "id": "skin_medium",
        "albedo": rgb(medium.albedo),
        "sigma_t": rgb(extinction / extinction.max()),
        "scale": float(extinction.max()),
        "phase": {"type": "isotropic"},
    }


def surface_words(
    boundary: Boundary, passing: SceneDict | None = None, roughness: float | SceneDict = 0.3
) -> SceneDict:
    """Return the surface of the skin, as light meets it from outside.

    passing : share that a refracting surface lets pass each way, a texture; None for all
    roughness : Beckmann m, a number or a texture
    """
    rough = {"distribution": "beckmann", "alpha": roughness}
    if boundary == "matched":
        mirror = {"type": "roughconductor", "material": "none", **rough}
        return {"type": "mask", "opacity": REFLECTED, "bsdf": mirror, "id": "skin_surface"}
    index: SceneDict = {"int_ior": SKIN_ETA, "ext_ior": 1.0}
    if passing is not None:
        index["specular_transmittance"] = passing
    if boundary == "smooth":
        return {"type": "dielectric", "id": "skin_surface", **index}
    return {"type": "roughdielectric", "id": "skin_surface", **rough, **index}


def _below(dimmed: bool) -> SceneDict:
    """Return a matched surface for light from below: it dims what leaves, by the skin's lightness."""
    if not dimmed:
        return {"type": "null", "id": "skin_below"}
    black = {"type": "diffuse", "reflectance": rgb((0.0, 0.0, 0.0))}
    return {"type": "mask", "opacity": _texture("held_back"), "bsdf": black, "id": "skin_below"}


def _frame(
    words: Words, scene: Scene, looks: Looks, boundary: Boundary, picture: tuple[int, int, int]
) -> list[ET.Element]:
    """Return all parts but the skin.

    picture : width, height [pixel], samples of each
    """
    sizes = zip(("width", "height", "samples"), map(str, picture), strict=True)
    sensor = mitsuba_sensor(words, scene.camera, picture[:2])
    sensor["film"] |= {"width": Given("integer", "width"), "height": Given("integer", "height")}
    sensor["sampler"]["sample_count"] = Given("integer", "samples")
    # Spectral MIS: extinction differs between channels, and sampling one of them makes the others noisy.
    integrator = {"type": "volpathmis", "rr_depth": ROULETTE_DEPTH, "hide_emitters": True}
    parts: list[SceneDict] = [integrator, sensor]
    lights = known_lights(scene.lights, MITSUBA, "Mitsuba")
    parts += [mitsuba_emitter(words, light, k) for k, light in enumerate(lights, start=1)]
    if scene.environment is not None:
        parts.append(mitsuba_environment(words, scene.environment))
    colour = {"type": "mesh_attribute", "name": "vertex_color"}
    plain = {"type": "principled", "roughness": _WET, "eta": SKIN_ETA, "base_color": colour}
    for index in looks.opaque:
        parts.append({"type": "ply", "filename": _opaque_file(index), "bsdf": plain})
    described = [element(part, "", words) for part in parts]
    skin = include("boundary_$boundary.xml")
    return [*(default(*one) for one in (("boundary", boundary), *sizes)), *described, skin]


def _skin(words: Words, boundary: Boundary, looks: Looks, made: Mapping[str, bytes]) -> list[ET.Element]:
    """Return the skin under a surface."""
    roughness = looks.roughness if isinstance(looks.roughness, float) else _texture("roughness")
    passing = None if looks.passing is None else _texture("passing")
    parts = [medium_words(looks.media[boundary]), surface_words(boundary, passing, roughness)]
    shapes = dict.fromkeys(("skin", "caps"), "skin_surface")
    if boundary == "matched":
        # Rays inwards meet the upper one and step over the lower one, rays outwards the other way round.
        parts.append(_below(passing is not None))
        shapes = dict.fromkeys(("upper", "upper_caps"), "skin_surface")
        shapes |= dict.fromkeys(("skin", "caps"), "skin_below")
    for name in (one for one in shapes if one in made):
        shape = {"type": "ply", "filename": f"meshes/{name}.ply", "bsdf": Ref(shapes[name])}
        parts.append({**shape, "interior": Ref("skin_medium")})
    return [element(part, "", words) for part in parts]


def _opaque_file(index: int) -> str:
    return f"meshes/material_{index}.ply"


def _texture(name: str) -> SceneDict:
    return {"type": "bitmap", "filename": f"textures/{name}.exr", "raw": True}
