"""Uniform records and pipeline constants of the skin's surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.gpu import ComputeProgram, UniformRecord
from dermis.gpu.shader_types import struct_dtype
from dermis.gpu.wgsl_source import ShaderListMember
from dermis.human import teeth
from dermis.human.skin.painted import PaintedMaps
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyeball import (
    CORNEA_MM,
    IRIS_MM,
    LIMBUS_MM,
    SCLERA_MM,
    apex_mm,
    cornea_centre_mm,
    iris_plane_mm,
)
from dermis.mesh.iris_light import iris_light_constants
from dermis.mesh.maps import Maps
from dermis.optics.bands import Bands, band_rows
from dermis.optics.equivalent_medium import equivalent_medium, oblique_offset_mm
from dermis.optics.gaussians import GaussianSum
from dermis.optics.slabs import anisotropic_response
from dermis.optics.thin_parts import oblique_transmittance
from dermis.scene.skin import DEFAULT_ROUGHNESS, Skin, lobe_name
from dermis.specular.albedo import MIN_ROUGHNESS_ROOT
from dermis.specular.fresnel import ENERGY_SCHEMES, SKIN_ETA, SKIN_F0
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]
DEFAULT_COLOUR = 0.8
"""Albedo of heads without a colour map [-]."""
_EYE_SEED_COUNT = 1000  # number of different eyes
_NO_RELIEF_LEVEL = -1.0
_VELLUS_PER_MM = 0.1  # extinction of the densest vellus hair, about 3 hairs of 1.5 mm by 20 um per mm2 [1/mm]
_MAX_OBLIQUE_OFFSET_MM = 3.0  # limit of the offset of oblique light, as the surface is flat only near a texel


def lobe_shaders() -> list[ShaderListMember]:
    """Return the shaders of the specular lobes in the order in which lobe.wgsl includes and numbers them."""
    return [ShaderListMember(name, model.shader) for name, model in MODELS.items()]


def lobe_constants() -> dict[str, float]:
    """Return the named values that the shader preprocessor inserts into lobe.wgsl and the lobes' shaders.

    It inserts them at `//#fill` directives.
    """
    model_numbers = {name: number for model in MODELS.values() for name, number in model.numbers.items()}
    return {"root_of_first_row": MIN_ROUGHNESS_ROOT, **model_numbers}


def eye_constants() -> dict[str, float]:
    """Return the named values that the shader preprocessor inserts into eye.wgsl and mouth.wgsl.

    It inserts them at `//#fill` directives.
    """
    return {
        "cornea_at": cornea_centre_mm(),
        "limbus_mm": LIMBUS_MM,
        "sclera_mm": SCLERA_MM,
        "cornea_mm": CORNEA_MM,
        "apex_at": apex_mm(),
        "iris_at": iris_plane_mm(),
        "iris_mm": IRIS_MM,
        **iris_light_constants(),
        "arch_mm": teeth.MM_PER_U,
        "crown_mm": teeth.MM_PER_V,
        "bite": teeth.BITING_EDGE_V,
        "middle": teeth.ARCH_MIDDLE_U,
    }


def fill_eye_records(eye_records: UniformRecord, look: EyeLook) -> None:
    """Write the appearance of eyes to the members of one or more records of the shader struct `Eye`."""
    for name in ("eumelanin", "pupil_mm", "redness"):
        eye_records[name] = getattr(look, name)
    eye_records["seed"] = look.seed % _EYE_SEED_COUNT


def surface_constants(skin: Skin) -> tuple[tuple[str, int], ...]:
    """Return the pipeline constants of lobe.wgsl for a skin; those with the default value 0 are left out."""
    numbers = {"MODEL": MODELS.names.index(lobe_name(skin)), "EXACT_FRESNEL": int(skin.fresnel == "exact")}
    return tuple((name, number) for name, number in numbers.items() if number)


def skin_record(
    shading_program: ComputeProgram,
    skin: Skin,
    maps: Maps,
    profile: GaussianSum,
    light_count: int,
    bands: Bands | None = None,
) -> UniformRecord:
    """Return the uniform record of the shader struct `Skin`.

    Members with the name of a field or property of `skin` are copied from it; all other members are derived.

    maps : maps of the head
    profile : diffusion profile of the skin
    light_count : number of lights; each part of a divided light counts as one
    bands : wavelengths in the place of red, green and blue
    """
    members = struct_dtype(shading_program.source.text, "Skin").names or ()
    values = {name: getattr(skin, name) for name in members if hasattr(skin, name)}
    values |= {"light_count": light_count, "bands": band_rows(bands)}
    return shading_program.make_record("Skin", **values, **_derived_skin_members(skin, maps, profile))


def _derived_skin_members(skin: Skin, maps: Maps, profile: GaussianSum) -> dict[str, ArrayLike]:
    """Return the members of the struct `Skin` that are not fields or properties of the Python class."""
    energy, usual = ENERGY_SCHEMES[skin.energy], DEFAULT_ROUGHNESS if maps.has_roughness else 1.0
    return {
        "m": skin.roughness_factor * skin.roughness / usual,
        "f0": SKIN_F0,
        "eta": SKIN_ETA,
        "loss": energy.loss,
        "returned": energy.returns_internal_light,
        "tint": skin.specular_colour == "wrong",
        "relief_band": _normal_map_level(maps),
        "vellus_per_mm": vellus_per_mm(maps),
        "lobes": _lobe_widths(skin),
        **(_light_direction_members(skin, maps, profile) if skin.direction == "half-space" else {}),
    }


def vellus_per_mm(maps: Maps) -> float:
    """Return the extinction coefficient of the vellus hair's layer; 0 for unpainted skin [1/mm]."""
    return _VELLUS_PER_MM * maps.look.vellus if isinstance(maps, PaintedMaps) else 0.0


def _lobe_widths(skin: Skin) -> tuple[float, float, float]:
    """Return squared roughness factors of the narrow and wide lobe, and the narrow lobe's weight [-]."""
    narrow, wide, weight = MODELS[lobe_name(skin)].lobes
    return narrow**2, wide**2, weight


def mean_half_space(skin: Skin, maps: Maps, profile: GaussianSum) -> tuple[Floats, float]:
    """Return the (3,) reflectance and the refractive index of a half-space with the mean skin colour [-]."""
    if skin.albedo == "profile":
        colour = np.asarray(profile.albedo, np.float64)
    elif maps.mean_colour is None:
        colour = np.full(3, DEFAULT_COLOUR)
    else:
        colour = np.asarray(maps.mean_colour, np.float64)
    return colour, 1.0 if skin.specular == "none" else SKIN_ETA


def _light_direction_members(skin: Skin, maps: Maps, profile: GaussianSum) -> dict[str, ArrayLike]:
    """Return the members of the struct `Skin` that direction.wgsl reads.

    They describe how reflectance and transmittance depend on the direction of light, and are computed for a
    half-space with the mean colour of the skin.
    """
    half_space = mean_half_space(skin, maps, profile)
    response = anisotropic_response(*half_space, skin.anisotropy)
    return {
        "eta_below": response.eta,
        "oblique_offset_mm": min(
            oblique_offset_mm(equivalent_medium(profile, *half_space)), _MAX_OBLIQUE_OFFSET_MM
        ),
        "mean_single_scattering": response.mean_kernel,
        "single_scattering": response.single_scattering,
        "uniform_reflectance": response.relative_diffuse_reflectance,
        "reflectance": np.pad(response.relative_reflectance, ((0, 0), (0, 1))),
        "transmittance": np.pad(
            oblique_transmittance(*half_space, profile.from_photons, skin.anisotropy), ((0, 0), (0, 1))
        ),
    }


def _normal_map_level(maps: Maps) -> float:
    """Return the mip level at which the height map is as large as the normal map, -1 if either is missing.

    Shaders add to the normal map only the relief of the height map that is finer than this level; for -1,
    they add all relief.
    """
    if maps.normal is None or maps.height is None:
        return _NO_RELIEF_LEVEL
    finer = max(maps.height.shape[:2]) / max(maps.normal.shape[:2])
    return float(np.log2(finer)) if finer > 1 else _NO_RELIEF_LEVEL
