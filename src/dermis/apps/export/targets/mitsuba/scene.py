"""Files of a Mitsuba scene; `mitsuba scene.xml -D boundary=rough` selects a surface model of the skin."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Literal, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.hair_curves import CurveGroup
from dermis.apps.export.scene_parts import supported_lights
from dermis.apps.export.targets.maps import encode_map_exr
from dermis.apps.export.targets.mitsuba import xml
from dermis.apps.export.targets.mitsuba.hairs import hair_files, hair_shape
from dermis.apps.export.targets.mitsuba.meshes import skin_meshes
from dermis.apps.export.targets.mitsuba.xml import XmlBackend
from dermis.apps.truths.lights import MITSUBA_LIGHTS, mitsuba_emitter
from dermis.apps.truths.mitsuba_scene import RUSSIAN_ROULETTE_DEPTH, mitsuba_sensor
from dermis.apps.truths.scene_description import SceneDict, mitsuba_environment, mitsuba_rgb
from dermis.formats.part_pictures import PartRole
from dermis.scene.model import Scene
from dermis.specular.fresnel import SKIN_ETA

Floats = NDArray[np.float32]
SurfaceModel = Literal["matched", "smooth", "rough"]
IOR_BY_SURFACE_MODEL: Mapping[SurfaceModel, float] = {"matched": 1.0, "smooth": SKIN_ETA, "rough": SKIN_ETA}
"""Surface models of the skin, with their index of refraction."""
INDEX_MATCHED_REFLECTANCE = 0.03
"""Reflectance of an index-matched surface in all directions: the mean reflectance of rough skin [-]."""
_OPAQUE_PART_ROUGHNESS = 0.3  # square root of Beckmann's m
_PART_IOR = 1.5  # of the metallic-roughness model
_PART_INPUTS: Mapping[PartRole, str] = {
    "colour": "base_color",
    "roughness": "roughness",
    "metalness": "metallic",
}
PART_ROLES: tuple[PartRole, ...] = (*_PART_INPUTS, "normal", "opacity")
"""Roles of the pictures of parts that are not skin."""


class IsotropicMedium(NamedTuple):
    """Homogeneous medium with isotropic scattering.

    sigma_t : (3,) extinction coefficient [1/mm]
    albedo : (3,) single-scattering albedo [-]
    """

    sigma_t: tuple[float, ...]
    albedo: tuple[float, ...]


class SkinAppearance(NamedTuple):
    """Media and textures of the skin, and the meshes of the head's other materials.

    media : dictionary from each surface model in `IOR_BY_SURFACE_MODEL` to the medium of the skin
    roughness : Beckmann m, a number or a map (n, n)
    transmittance : (n, n, 3) map of a factor; a refracting surface multiplies light by this factor on entry
        and again on exit; None for uniform skin
    dimming : (n, n) fraction of the emerging light that an index-matched surface absorbs; None for uniform
        skin
    opaque : dictionary from material index to the PLY file of a mesh, for all materials except skin
    pictured : dictionary from material index to the roles of the texture images that the material uses, such
        as "colour"; materials without texture images are absent
    pictures : dictionary from role to the PNG file of a texture image, which all materials share
    hairs : groups of hairs with similar absorption
    """

    media: Mapping[SurfaceModel, IsotropicMedium]
    roughness: float | Floats
    transmittance: Floats | None = None
    dimming: Floats | None = None
    opaque: Mapping[int, bytes] = MappingProxyType({})
    pictured: Mapping[int, set[PartRole]] = MappingProxyType({})
    pictures: Mapping[PartRole, bytes] = MappingProxyType({})
    hairs: tuple[CurveGroup, ...] = ()


def scene_files(
    scene: Scene,
    skin_appearance: SkinAppearance,
    surface_model: SurfaceModel,
    picture_size: tuple[int, int],
    samples_per_pixel: int,
) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each file of the scene, with scene.xml first.

    surface_model : surface model of the skin that scene.xml selects by default
    picture_size : width and height of the picture [pixel]
    samples_per_pixel : number of paths that Mitsuba traces for each pixel

    Raises DermisError for what Mitsuba does not support: lights without shadows, a camera with a shifted
    lens, and skin that does not enclose a volume.
    """
    backend = XmlBackend()
    meshes = skin_meshes(backend, scene.head)
    yield (
        "scene.xml",
        xml.scene_document(
            _scene_elements(
                backend, scene, skin_appearance, surface_model, (*picture_size, samples_per_pixel)
            )
        ),
    )
    for each in IOR_BY_SURFACE_MODEL:
        yield (
            f"boundary_{each}.xml",
            xml.scene_document(_skin_elements(backend, each, skin_appearance, meshes)),
        )
    yield from ((f"meshes/{name}.ply", content) for name, content in meshes.items())
    yield from hair_files(skin_appearance.hairs).items()
    for index, content in skin_appearance.opaque.items():
        yield _opaque_mesh_file(index), content
    yield from ((_part_picture_file(role), content) for role, content in skin_appearance.pictures.items())
    if skin_appearance.transmittance is not None and skin_appearance.dimming is not None:
        yield "textures/passing.exr", encode_map_exr("passing", skin_appearance.transmittance)
        yield "textures/held_back.exr", encode_map_exr("held_back", skin_appearance.dimming)
    if not isinstance(skin_appearance.roughness, float):
        yield "textures/roughness.exr", encode_map_exr("roughness", skin_appearance.roughness)
    for index, values in enumerate(backend.bitmaps):
        yield xml.bitmap_path(index), encode_map_exr("light", np.asarray(values, np.float32))


def medium_description(medium: IsotropicMedium) -> SceneDict:
    """Return Mitsuba's description of a homogeneous medium, in mm.

    The extinction coefficients are divided by the largest of them, which is written as the medium's scale.
    Mitsuba multiplies the coefficients by this scale.
    """
    extinction = np.asarray(medium.sigma_t)
    return {
        "type": "homogeneous",
        "id": "skin_medium",
        "albedo": mitsuba_rgb(medium.albedo),
        "sigma_t": mitsuba_rgb(extinction / extinction.max()),
        "scale": float(extinction.max()),
        "phase": {"type": "isotropic"},
    }


def surface_bsdf(
    surface_model: SurfaceModel, transmittance: SceneDict | None = None, roughness: float | SceneDict = 0.3
) -> SceneDict:
    """Return Mitsuba's description of the skin's surface, or of the outer one of its two layers.

    Only the surface model "matched" has two layers. Its medium has the refractive index of air, so that its
    boundary does not reflect; an outer layer is added to reflect light. For the inner layer, see
    `_lower_surface_bsdf`.

    surface_model : surface model of the skin
    transmittance : texture that scales light on entry and again on exit; None for a factor of 1
    roughness : Beckmann m, a number or a texture
    """
    facets = {"distribution": "beckmann", "alpha": roughness}
    if surface_model == "matched":
        mirror = {"type": "roughconductor", "material": "none", **facets}
        return {"type": "mask", "opacity": INDEX_MATCHED_REFLECTANCE, "bsdf": mirror, "id": "skin_surface"}
    refraction: SceneDict = {"int_ior": SKIN_ETA, "ext_ior": 1.0}
    if transmittance is not None:
        refraction["specular_transmittance"] = transmittance
    if surface_model == "smooth":
        return {"type": "dielectric", "id": "skin_surface", **refraction}
    return {"type": "roughdielectric", "id": "skin_surface", **facets, **refraction}


def _lower_surface_bsdf(has_dimming_texture: bool) -> SceneDict:
    """Return Mitsuba's description of the inner layer of an index-matched surface.

    Where the skin is darker than its medium, this layer absorbs part of the light that leaves the skin.

    has_dimming_texture : whether the skin has a texture of the absorbed fraction
    """
    if not has_dimming_texture:
        return {"type": "null", "id": "skin_below"}
    black = {"type": "diffuse", "reflectance": mitsuba_rgb((0.0, 0.0, 0.0))}
    return {"type": "mask", "opacity": _exr_texture("held_back"), "bsdf": black, "id": "skin_below"}


def _scene_elements(
    xml_backend: XmlBackend,
    scene: Scene,
    skin_appearance: SkinAppearance,
    surface_model: SurfaceModel,
    picture_size_and_samples: tuple[int, int, int],
) -> list[ET.Element]:
    """Return the XML elements of the scene except the skin, which is included from its own XML file.

    surface_model : surface model of the skin that is included by default
    picture_size_and_samples : width and height of the picture [pixel], and samples per pixel
    """
    sizes = zip(("width", "height", "samples"), map(str, picture_size_and_samples), strict=True)
    sensor = mitsuba_sensor(xml_backend, scene.camera, picture_size_and_samples[:2])
    sensor["film"] |= {
        "width": xml.CommandLineProperty("integer", "width"),
        "height": xml.CommandLineProperty("integer", "height"),
    }
    sensor["sampler"]["sample_count"] = xml.CommandLineProperty("integer", "samples")
    # Spectral multiple importance sampling, as extinction differs between channels.
    integrator = {"type": "volpathmis", "rr_depth": RUSSIAN_ROULETTE_DEPTH, "hide_emitters": True}
    parts: list[SceneDict] = [integrator, sensor]
    lights = supported_lights(scene.lights, MITSUBA_LIGHTS, "Mitsuba")
    parts += [mitsuba_emitter(xml_backend, light, k) for k, light in enumerate(lights, start=1)]
    if scene.environment is not None:
        parts.append(mitsuba_environment(xml_backend, scene.environment))
    colour = {"type": "mesh_attribute", "name": "vertex_color"}
    opaque = {
        "type": "principled",
        "roughness": _OPAQUE_PART_ROUGHNESS,
        "eta": SKIN_ETA,
        "base_color": colour,
    }
    for role in skin_appearance.pictures:
        texture = {"type": "bitmap", "id": _part_texture(role).name, "filename": _part_picture_file(role)}
        parts.append({**texture, "raw": role != "colour", "wrap_mode": "clamp"})
    for index in skin_appearance.opaque:
        roles = skin_appearance.pictured.get(index)
        bsdf = opaque if roles is None else _part_bsdf(roles)
        parts.append({"type": "ply", "filename": _opaque_mesh_file(index), "bsdf": bsdf})
    parts += map(hair_shape, skin_appearance.hairs)
    defaults = [xml.default_property_element(*one) for one in (("boundary", surface_model), *sizes)]
    elements = [xml.object_element(part, "", xml_backend) for part in parts]
    return [*defaults, *elements, xml.include_element("boundary_$boundary.xml")]


def _skin_elements(
    xml_backend: XmlBackend,
    surface_model: SurfaceModel,
    skin_appearance: SkinAppearance,
    meshes_by_shape_name: Mapping[str, bytes],
) -> list[ET.Element]:
    """Return the XML elements of the skin with one surface model: medium, surface and shapes.

    meshes_by_shape_name : dictionary from shape name to the PLY file of a surface of the skin
    """
    roughness = (
        skin_appearance.roughness
        if isinstance(skin_appearance.roughness, float)
        else _exr_texture("roughness")
    )
    transmittance = None if skin_appearance.transmittance is None else _exr_texture("passing")
    parts = [
        medium_description(skin_appearance.media[surface_model]),
        surface_bsdf(surface_model, transmittance, roughness),
    ]
    shapes = dict.fromkeys(("skin", "caps"), "skin_surface")
    if surface_model == "matched":
        # Inward rays hit the upper surface and skip the lower one, outward rays the reverse.
        parts.append(_lower_surface_bsdf(transmittance is not None))
        shapes = dict.fromkeys(("upper", "upper_caps"), "skin_surface")
        shapes |= dict.fromkeys(("skin", "caps"), "skin_below")
    for name in (name for name in shapes if name in meshes_by_shape_name):
        shape = {"type": "ply", "filename": f"meshes/{name}.ply", "bsdf": xml.ObjectReference(shapes[name])}
        parts.append({**shape, "interior": xml.ObjectReference("skin_medium")})
    return [xml.object_element(part, "", xml_backend) for part in parts]


def _part_bsdf(image_roles: set[PartRole]) -> SceneDict:
    """Return Mitsuba's BSDF for a material that is not skin and has texture images.

    image_roles : roles of these images, such as "colour"
    """
    bsdf: SceneDict = {"type": "principled", "eta": _PART_IOR, "roughness": _OPAQUE_PART_ROUGHNESS}
    bsdf |= {name: _part_texture(role) for role, name in _PART_INPUTS.items() if role in image_roles}
    if "normal" in image_roles:
        bsdf = {"type": "normalmap", "normalmap": _part_texture("normal"), "bsdf": bsdf}
    bsdf = {"type": "twosided", "bsdf": bsdf}
    return (
        {"type": "mask", "opacity": _part_texture("opacity"), "bsdf": bsdf}
        if "opacity" in image_roles
        else bsdf
    )


def _part_texture(image_role: PartRole) -> xml.ObjectReference:
    return xml.ObjectReference(f"parts_{image_role}")


def _part_picture_file(image_role: PartRole) -> str:
    return f"textures/{_part_texture(image_role).name}.png"


def _opaque_mesh_file(material_index: int) -> str:
    return f"meshes/material_{material_index}.ply"


def _exr_texture(texture_name: str) -> SceneDict:
    return {"type": "bitmap", "filename": f"textures/{texture_name}.exr", "raw": True}
