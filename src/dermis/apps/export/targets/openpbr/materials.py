"""Materials of OpenPBR: values, the maps that drive inputs, and their files."""

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
from dermis.apps.export.target import floats, write_files
from dermis.human.person_file import relief_slopes
from dermis.images.codecs import encode_png
from dermis.images.colour import encode_srgb8
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Material
from dermis.scene.skin import DEFAULT_ROUGHNESS, Skin
from dermis.specular.fresnel import SKIN_ETA

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Value = float | tuple[float, ...]

OPEN_PBR, STANDARD = "open_pbr_surface", "standard_surface"
_STANDARD_NAMES: Mapping[str, str] = {
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
}
_METRES_PER_MM = 1e-3
_MAX_NAME_LENGTH = 40
_EYE_IOR = 1.376
_ROUGHNESS = {"eye": 0.1, "teeth": 0.3, "tongue": 0.4}  # by a word in the name
_DEFAULT_ROUGHNESS = 0.8
INPUTS: Mapping[str, str] = {
    "colour": "subsurface_color",
    "roughness": "specular_roughness",
    "specular": "specular_weight",
    "normal": "geometry_normal",
}
"""Input that each map drives."""
DISTANCES = ("subsurface_radius",)
"""Inputs with a length [m]."""


def input_name(shader: str, name: str) -> str:
    """Return the name of an input of OpenPBR in a shader."""
    return name if shader == OPEN_PBR else _STANDARD_NAMES[name]


class MapType(NamedTuple):
    """Type and colour space of a map in MaterialX, and its colour space in USD's preview."""

    type: str
    space: str
    preview_space: str


MAPS: Mapping[str, MapType] = {
    "colour": MapType("color3", "srgb_texture", "sRGB"),
    "roughness": MapType("float", "", "raw"),
    "specular": MapType("float", "", "raw"),
    "normal": MapType("vector3", "", "raw"),
    "eye": MapType("color3", "srgb_texture", "sRGB"),
}


@dataclass(frozen=True)
class OpenPbrMaterial:
    """A material.

    name : any text
    values : of inputs, lengths in metres
    maps : names of maps by the inputs that they drive
    """

    name: str
    values: Mapping[str, Value]
    maps: Mapping[str, str]


def skin_material(
    name: str,
    skin: Skin,
    radius_m: tuple[float, float, float],
    colour: tuple[float, ...],
    roles: Iterable[str],
) -> OpenPbrMaterial:
    """Return the material of skin.

    radius_m : mean free paths
    colour : of skin without a map of it, linear Rec. 709 [-]
    roles : of the maps that there are
    """
    longest = max(radius_m)
    values: dict[str, Value] = {
        "base_color": colour,
        "subsurface_weight": 1.0,
        "subsurface_color": colour,
        "subsurface_radius": longest,
        "subsurface_radius_scale": tuple(one / longest for one in radius_m),
        "subsurface_scatter_anisotropy": 0.0,
        "specular_weight": skin.strength,
        "specular_ior": SKIN_ETA,
        "specular_roughness": float(np.sqrt(skin.roughness * skin.smoothing)),
    }
    driven = {INPUTS[role]: role for role in roles}
    return OpenPbrMaterial(name, {key: value for key, value in values.items() if key not in driven}, driven)


def opaque_material(one: Material) -> OpenPbrMaterial:
    """Return the material of what is not skin."""
    rough = next((value for word, value in _ROUGHNESS.items() if word in one.name.casefold()), _DEFAULT_ROUGHNESS)
    ior = _EYE_IOR if "eye" in one.name.casefold() else SKIN_ETA
    red, green, blue = (float(part) for part in one.colour)
    return OpenPbrMaterial(
        one.name, {"base_color": (red, green, blue), "specular_roughness": rough, "specular_ior": ior}, {}
    )


def eye_material(name: str) -> OpenPbrMaterial:
    """Return the material of an eyeball with a map of its colour."""
    wet: dict[str, Value] = {"specular_roughness": _ROUGHNESS["eye"], "specular_ior": _EYE_IOR}
    return OpenPbrMaterial(name, wet, {"base_color": "eye"})


def hair_material(absorption: Floats, radius_mm: float) -> OpenPbrMaterial:
    """Return the material of hairs, a plain surface of their mean colour.

    absorption : (n, 3) of their inside [1/mm]

    Source: [Chiang2016] eq. 9 for the colour, at a roughness of 0.3.
    """
    depth = np.sqrt(np.maximum(absorption.mean(axis=0), 0.0) * radius_mm)
    red, green, blue = (float(part) for part in np.exp(-5.888 * depth))
    return OpenPbrMaterial(
        "hair", {"base_color": (red, green, blue), "specular_roughness": 0.4, "specular_ior": 1.55}, {}
    )


def map_arrays(maps: Maps, skin: Skin, slopes: Floats | None = None) -> dict[str, Floats]:
    """Return the maps of a skin by role, as numbers that go into files.

    slopes : (n, n, 2) of the relief, where `maps` has no normals
    """
    found: dict[str, Floats] = {}
    if maps.colour is not None and skin.albedo == "map":
        found["colour"] = maps.colour
    if maps.roughness is not None:
        rough = maps.roughness * np.float32(skin.roughness / DEFAULT_ROUGHNESS * skin.smoothing)
        found["roughness"] = np.sqrt(np.clip(rough, 0.0, 1.0))
    if maps.specular is not None and (mean := float(maps.specular.mean())) > 0:
        found["specular"] = np.clip(maps.specular * np.float32(skin.strength / mean), 0.0, 1.0)
    shown = slopes if maps.normal is None else maps.normal
    if shown is not None:
        normal = np.concatenate([-shown, np.ones_like(shown[..., :1])], axis=-1)
        found["normal"] = 0.5 + 0.5 * normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    return found


def encode_map_files(found: Mapping[str, Floats]) -> dict[str, bytes]:
    """Return PNG files of 8 bits by role."""
    with ThreadPoolExecutor() as pool:  # zlib does not hold other threads up
        return dict(zip(found, pool.map(_png, found, found.values()), strict=True))


def _png(role: str, values: Floats) -> bytes:
    if role in ("colour", "eye"):
        return encode_png(encode_srgb8(values))
    levels = np.rint(np.clip(values, 0.0, 1.0) * 255).astype(np.uint8)
    return encode_png(levels if levels.ndim == 3 else levels[..., None])


def file_prefix(file: Path, subject: Subject) -> str:
    """Return the prefix of the names of the files beside a target's main file."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", file.stem).strip("_")[:_MAX_NAME_LENGTH]
    return f"{plain or subject.identifier}_"


def write_maps(subject: Subject, folder: Path, prefix: str) -> dict[str, Path]:
    """Write the maps of the skin; return their paths by role, none for a skin by itself."""
    if subject.head is None:
        return {}
    found = encode_map_files(map_arrays(subject.head.maps, subject.skin, relief_slopes(subject.head)))
    written = write_files(folder, ((f"{prefix}{role}.png", data) for role, data in found.items()))
    return dict(zip(found, written, strict=True))


def mesh_materials(subject: Subject, mfp_mm: Doubles, roles: Iterable[str]) -> dict[int, OpenPbrMaterial]:
    """Return materials by their number in the subject's mesh.

    mfp_mm : (3,) mean free paths of the skin
    roles : of the maps that there are
    """
    red, green, blue = (_METRES_PER_MM * float(one) for one in mfp_mm)
    colour = floats(subject.clipped_albedo())
    mesh, known = subject.head_or_ball.mesh, list(roles)
    looks = {}
    for kind in sorted(set(mesh.material.tolist())):
        one = mesh.materials[kind]
        if one.kind == "skin":
            looks[kind] = skin_material(one.name, subject.skin, (red, green, blue), colour, known)
        else:
            looks[kind] = opaque_material(one)
    return looks
