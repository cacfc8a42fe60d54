"""OpenPBR materials of a head, and the files of the maps that set inputs of these materials."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import flat_tuple, write_files
from dermis.formats.part_pictures import PartPictures, PartRole
from dermis.human.person_file import relief_slopes
from dermis.images.codecs import encode_png
from dermis.images.colour import encode_srgb8
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material
from dermis.scene.skin import DEFAULT_ROUGHNESS, Skin
from dermis.specular.fresnel import SKIN_ETA

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
InputValue = float | tuple[float, ...]

OPEN_PBR, STANDARD_SURFACE = "open_pbr_surface", "standard_surface"
_STANDARD_SURFACE_NAMES: Mapping[str, str] = {
    "base_color": "base_color",
    "subsurface_weight": "subsurface",
    "subsurface_color": "subsurface_color",
    "subsurface_radius": "subsurface_scale",
    "subsurface_radius_scale": "subsurface_radius",
    "subsurface_scatter_anisotropy": "subsurface_anisotropy",
    "specular_weight": "specular",
    "specular_ior": "specular_IOR",
    "specular_roughness": "specular_roughness",
    "geometry_normal": "normal",
    "base_metalness": "metalness",
    "geometry_opacity": "opacity",
    "emission_color": "emission_color",
    "emission_luminance": "emission",
    "fuzz_weight": "sheen",
    "fuzz_color": "sheen_color",
    "fuzz_roughness": "sheen_roughness",
}
_METRES_PER_MM = 1e-3
_MAX_MATERIAL_NAME_LENGTH = 40
_CORNEA_IOR = 1.376
_ROUGHNESS_BY_KIND = {"eye": 0.1, "teeth": 0.3, "tongue": 0.4}  # by a part of the material's name
_DEFAULT_PART_ROUGHNESS = 0.8
_FUZZ_WHITENESS, _FUZZ_ROUGHNESS = 0.5, 0.4  # of cloth, as in parts.wgsl and sheen.wgsl
_PART_IOR = 1.5  # of the metallic-roughness model
PART_PREFIX = "parts_"
"""Prefix of a map's role if the map belongs to a part of the head that is not skin."""
MAP_INPUTS: Mapping[str, str] = {
    "colour": "subsurface_color",
    "roughness": "specular_roughness",
    "specular": "specular_weight",
    "normal": "geometry_normal",
}
"""OpenPBR input that each map sets, by the role of the map."""
_PART_INPUTS: Mapping[PartRole, str] = {
    "colour": "base_color",
    "opacity": "geometry_opacity",
    "roughness": "specular_roughness",
    "metalness": "base_metalness",
    "normal": "geometry_normal",
    "emission": "emission_color",
}
LENGTH_INPUTS = ("subsurface_radius",)
"""Inputs that are lengths [m]."""


def input_name(shader_category: str, open_pbr_name: str) -> str:
    """Return the name that an input of OpenPBR has in a shader.

    shader_category : `OPEN_PBR` or `STANDARD_SURFACE`
    open_pbr_name : name of the input in OpenPBR
    """
    return open_pbr_name if shader_category == OPEN_PBR else _STANDARD_SURFACE_NAMES[open_pbr_name]


class MapType(NamedTuple):
    """Type and colour space of a map in MaterialX, and colour space of the map in UsdPreviewSurface."""

    type: str
    space: str
    preview_space: str


MAP_TYPES: Mapping[str, MapType] = {
    "colour": MapType("color3", "srgb_texture", "sRGB"),
    "roughness": MapType("float", "", "raw"),
    "specular": MapType("float", "", "raw"),
    "normal": MapType("vector3", "", "raw"),
    "eye": MapType("color3", "srgb_texture", "sRGB"),
    "parts_colour": MapType("color3", "srgb_texture", "sRGB"),
    "parts_opacity": MapType("float", "", "raw"),
    "parts_roughness": MapType("float", "", "raw"),
    "parts_metalness": MapType("float", "", "raw"),
    "parts_normal": MapType("vector3", "", "raw"),
    "parts_emission": MapType("color3", "srgb_texture", "sRGB"),
}


@dataclass(frozen=True)
class OpenPbrMaterial:
    """OpenPBR material: its inputs, each of which is set by a value or a map.

    name : name of the material; any text
    values : value of each input without a map; lengths in metres
    maps : for each input that a map sets, the role of this map, such as "colour"
    """

    name: str
    values: Mapping[str, InputValue]
    maps: Mapping[str, str]


def skin_material(
    material_name: str,
    skin: Skin,
    radius_m: tuple[float, float, float],
    uniform_colour: tuple[float, ...],
    map_roles: Iterable[str],
) -> OpenPbrMaterial:
    """Return the OpenPBR material of skin.

    radius_m : (3,) mean free paths [m]
    uniform_colour : (3,) colour of the skin if it has no colour map; linear Rec. 709 [-]
    map_roles : roles of the maps that replace uniform values
    """
    longest = max(radius_m)
    values: dict[str, InputValue] = {
        "base_color": uniform_colour,
        "subsurface_weight": 1.0,
        "subsurface_color": uniform_colour,
        "subsurface_radius": longest,
        "subsurface_radius_scale": tuple(one / longest for one in radius_m),
        "subsurface_scatter_anisotropy": 0.0,
        "specular_weight": skin.specular_strength,
        "specular_ior": SKIN_ETA,
        "specular_roughness": float(np.sqrt(skin.roughness * skin.roughness_factor)),
    }
    mapped = {MAP_INPUTS[role]: role for role in map_roles}
    return OpenPbrMaterial(
        material_name, {key: value for key, value in values.items() if key not in mapped}, mapped
    )


def untextured_part_material(material: Material) -> OpenPbrMaterial:
    """Return the OpenPBR material, without textures, of a part of the head such as teeth or clothing."""
    name, roughness = material.name.casefold(), material.roughness
    if roughness is None:
        roughness = next(
            (value for part, value in _ROUGHNESS_BY_KIND.items() if part in name), _DEFAULT_PART_ROUGHNESS
        )
    values: dict[str, InputValue] = {
        "base_color": flat_tuple(material.colour),
        "specular_roughness": roughness,
        "specular_ior": _CORNEA_IOR if "eye" in name else SKIN_ETA,
    }
    if material.metalness > 0.0:
        values["base_metalness"] = material.metalness
    if material.fabric is not None:
        fibres = np.array(material.colour) * (1.0 - _FUZZ_WHITENESS) + _FUZZ_WHITENESS
        values |= {"fuzz_weight": min(material.fabric.sheen, 1.0), "fuzz_roughness": _FUZZ_ROUGHNESS}
        values["fuzz_color"] = flat_tuple(fibres)
    return OpenPbrMaterial(material.name, values, {})


def textured_part_material(material: Material, part_pictures: PartPictures) -> OpenPbrMaterial:
    """Return the OpenPBR material of a part of the head that is not skin and has texture images."""
    roles = part_pictures.needed_roles(material)
    maps = {name: f"{PART_PREFIX}{role}" for role, name in _PART_INPUTS.items() if role in roles}
    values = {**untextured_part_material(material).values, "specular_ior": _PART_IOR}
    if max(material.emission) > 0.0:
        values["emission_luminance"], values["emission_color"] = part_pictures.emission_strength_and_colour(
            material
        )
    return OpenPbrMaterial(
        material.name, {key: value for key, value in values.items() if key not in maps}, maps
    )


def eye_material(material_name: str) -> OpenPbrMaterial:
    """Return the OpenPBR material of an eyeball with a colour map."""
    values: dict[str, InputValue] = {
        "specular_roughness": _ROUGHNESS_BY_KIND["eye"],
        "specular_ior": _CORNEA_IOR,
    }
    return OpenPbrMaterial(material_name, values, {"base_color": "eye"})


def hair_material(absorption_per_mm: Floats, radius_mm: float) -> OpenPbrMaterial:
    """Return the OpenPBR material of hairs: an opaque surface with the mean colour of the hairs.

    absorption_per_mm : (n, 3) absorption coefficient inside each of n hairs [1/mm]
    radius_mm : radius of the hairs [mm]

    Source: [Chiang2016] eq. 9 for the colour, at a roughness of 0.3.
    """
    colour = flat_tuple(np.exp(-5.888 * np.sqrt(np.maximum(absorption_per_mm.mean(axis=0), 0.0) * radius_mm)))
    values: dict[str, InputValue] = {"base_color": colour, "specular_roughness": 0.4, "specular_ior": 1.55}
    return OpenPbrMaterial("hair", values, {})


def open_pbr_maps(head_maps: Maps, skin: Skin, slopes: Floats | None = None) -> dict[str, Floats]:
    """Return the maps of the skin by role, converted to the values that OpenPBR expects.

    slopes : (n, n, 2) slopes of the height map, from which normals are computed if `head_maps` has no
        normals
    """
    arrays: dict[str, Floats] = {}
    if head_maps.colour is not None and skin.albedo == "map":
        arrays["colour"] = head_maps.colour
    if head_maps.roughness is not None:
        roughness = head_maps.roughness * np.float32(
            skin.roughness / DEFAULT_ROUGHNESS * skin.roughness_factor
        )
        arrays["roughness"] = np.sqrt(np.clip(roughness, 0.0, 1.0))
    if head_maps.specular is not None and (mean := float(head_maps.specular.mean())) > 0:
        arrays["specular"] = np.clip(head_maps.specular * np.float32(skin.specular_strength / mean), 0.0, 1.0)
    gradient = slopes if head_maps.normal is None else head_maps.normal
    if gradient is not None:
        normal = np.concatenate([-gradient, np.ones_like(gradient[..., :1])], axis=-1)
        arrays["normal"] = 0.5 + 0.5 * normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    return arrays


def encode_map_files(maps_by_role: Mapping[str, Floats]) -> dict[str, bytes]:
    """Return a dictionary from the role of each map to the map as an 8-bit PNG file."""
    with ThreadPoolExecutor() as pool:  # compression releases the interpreter lock
        return dict(
            zip(maps_by_role, pool.map(_encode_map_png, maps_by_role, maps_by_role.values()), strict=True)
        )


def _encode_map_png(map_role: str, texels: Floats) -> bytes:
    if map_role in ("colour", "eye"):
        return encode_png(encode_srgb8(texels))
    levels = np.rint(np.clip(texels, 0.0, 1.0) * 255).astype(np.uint8)
    return encode_png(levels if levels.ndim == 3 else levels[..., None])


def file_prefix(main_file: Path, subject: Subject) -> str:
    """Return the prefix of the names of map and mesh files beside a target's main file."""
    identifier = re.sub(r"[^A-Za-z0-9]+", "_", main_file.stem).strip("_")[:_MAX_MATERIAL_NAME_LENGTH]
    return f"{identifier or subject.identifier}_"


def write_maps(subject: Subject, output_folder: Path, file_name_prefix: str) -> dict[str, Path]:
    """Write the maps of the head's skin as PNG files, and return a dictionary from role to path.

    file_name_prefix : prefix of the file names
    """
    if subject.head is None:
        return {}
    files = encode_map_files(open_pbr_maps(subject.head.maps, subject.skin, relief_slopes(subject.head)))
    written = write_files(
        output_folder, ((f"{file_name_prefix}{role}.png", data) for role, data in files.items())
    )
    return dict(zip(files, written, strict=True))


def write_part_pictures(
    subject: Subject, output_folder: Path, file_name_prefix: str, additional_roles: Iterable[PartRole] = ()
) -> list[Path]:
    """Write PNG files of the texture images of the head's parts that are not skin; return the paths.

    file_name_prefix : prefix of the file names
    additional_roles : roles of additional images to write, which OpenPBR does not use
    """
    if subject.part_pictures is None:
        return []
    files = subject.part_pictures.encode([*_PART_INPUTS, *additional_roles])
    return write_files(
        output_folder, ((f"{file_name_prefix}{PART_PREFIX}{role}.png", data) for role, data in files.items())
    )


def mesh_materials(subject: Subject, mfp_mm: Doubles, map_roles: Iterable[str]) -> dict[int, OpenPbrMaterial]:
    """Return a dictionary from material index in the subject's mesh to OpenPBR material.

    mfp_mm : (3,) mean free paths of the skin [mm]
    map_roles : roles of the maps that replace uniform values of the skin
    """
    red, green, blue = (_METRES_PER_MM * float(path) for path in mfp_mm)
    colour, known_roles = flat_tuple(subject.clipped_albedo()), list(map_roles)
    mesh, parts = subject.head_or_ball.mesh, subject.part_pictures

    def material_definition(material: Material) -> OpenPbrMaterial:
        if parts is not None and material.has_maps:
            return textured_part_material(material, parts)
        if material.kind != "skin":
            return untextured_part_material(material)
        return skin_material(material.name, subject.skin, (red, green, blue), colour, known_roles)

    return {index: material_definition(mesh.materials[index]) for index in np.unique(mesh.material).tolist()}
