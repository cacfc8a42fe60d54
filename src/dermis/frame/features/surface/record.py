"""The surface of the skin as the shaders read it: numbers, pipeline constants and tables."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.gpu import ComputeProgram, Record
from dermis.gpu.shader_types import struct_dtype
from dermis.gpu.wgsl_source import Member
from dermis.human import teeth
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyeball import CORNEA_MM, LIMBUS_MM, SCLERA_MM, apex_mm, cornea_centre_mm, iris_mm
from dermis.mesh.maps import Maps
from dermis.optics.flesh import aside_mm, medium_of
from dermis.optics.gaussians import GaussianSum
from dermis.optics.slabs import forward_directions
from dermis.optics.thin_parts import across
from dermis.scene.skin import USUAL_ROUGHNESS, Skin, lobe_name
from dermis.specular.albedo import ROOT_OF_FIRST_ROW
from dermis.specular.fresnel import ENERGY, SKIN_ETA, SKIN_F0
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]
DEFAULT_COLOUR = 0.8
"""Albedo of heads without a colour map."""
_EYE_SEEDS = 1000  # that look different
_NO_BAND = -1.0
_MOST_ASIDE_MM = 3.0  # farther, the surface no longer goes on as it does at a texel


def lobe_shaders() -> list[Member]:
    """The models as lobe.wgsl includes them, numbered in order."""
    return [Member(name, model.shader) for name, model in MODELS.items()]


def surface_numbers() -> dict[str, float]:
    """Numbers that lobe.wgsl and the models' shaders fill in."""
    of_models = {name: number for model in MODELS.values() for name, number in model.numbers.items()}
    return {"root_of_first_row": ROOT_OF_FIRST_ROW, **of_models}


def eye_numbers() -> dict[str, float]:
    """Numbers that eye.wgsl and mouth.wgsl fill in."""
    return {
        "cornea_at": cornea_centre_mm(),
        "limbus_mm": LIMBUS_MM,
        "sclera_mm": SCLERA_MM,
        "cornea_mm": CORNEA_MM,
        "apex_at": apex_mm(),
        "iris_at": iris_mm(),
        "arch_mm": teeth.ARCH_MM,
        "crown_mm": teeth.CROWN_MM,
        "bite": teeth.BITE,
        "middle": teeth.MIDDLE,
    }


def fill_eye(record: Record, look: EyeLook) -> None:
    """Tell a shader's `Eye`, or some of them, what eyes look like."""
    for name in ("eumelanin", "pupil_mm", "redness"):
        record[name] = getattr(look, name)
    record["seed"] = look.seed % _EYE_SEEDS


def surface_constants(skin: Skin) -> tuple[tuple[str, int], ...]:
    """Values of lobe.wgsl's `override`s where they are not the default 0."""
    numbers = {"MODEL": MODELS.names.index(lobe_name(skin)), "EXACT_FRESNEL": int(skin.fresnel == "exact")}
    return tuple((name, number) for name, number in numbers.items() if number)


def skin_record(
    program: ComputeProgram, skin: Skin, maps: Maps, profile: GaussianSum, light_count: int
) -> Record:
    """The shader's `Skin`: members that the model has by name come from it, the others are derived.

    profile : of the skin
    """
    members = struct_dtype(program.source.text, "Skin").names or ()
    dials = {name: getattr(skin, name) for name in members if hasattr(skin, name)}
    return program.record("Skin", **dials, **_derived(skin, maps, profile), light_count=light_count)


def _derived(skin: Skin, maps: Maps, profile: GaussianSum) -> dict[str, ArrayLike]:
    """Members that no field or property of the model holds; the usual roughness leaves a map as it is."""
    energy, usual = ENERGY[skin.energy], USUAL_ROUGHNESS if maps.rough else 1.0
    return {
        "m": skin.smoothing * skin.roughness / usual,
        "f0": SKIN_F0,
        "eta": SKIN_ETA,
        "loss": energy.loss,
        "returned": energy.returned,
        "tint": skin.specular_colour == "wrong",
        "relief_band": _relief_band(maps),
        **(_by_direction(skin, maps, profile) if skin.direction == "half-space" else {}),
    }


def half_space_of(skin: Skin, maps: Maps, profile: GaussianSum) -> tuple[Floats, float]:
    """(3,) what the half-space of the skin's mean colour returns of light from above, and its index."""
    if skin.albedo == "profile":
        colour = np.asarray(profile.albedo, np.float64)
    elif maps.mean_colour is None:
        colour = np.full(3, DEFAULT_COLOUR)
    else:
        colour = np.asarray(maps.mean_colour, np.float64)
    return colour, 1.0 if skin.specular == "none" else SKIN_ETA


def _by_direction(skin: Skin, maps: Maps, profile: GaussianSum) -> dict[str, ArrayLike]:
    """Members that direction.wgsl reads, for half-spaces of the skin's mean colour."""
    half_space = half_space_of(skin, maps, profile)
    law = forward_directions(*half_space, skin.anisotropy)
    return {
        "inner_eta": law.eta,
        "aside_mm": min(aside_mm(medium_of(profile, *half_space)), _MOST_ASIDE_MM),
        "mean_once": law.mean_once,
        "once": law.once,
        "back_from_everywhere": law.from_everywhere,
        "back": np.pad(law.returned, ((0, 0), (0, 1))),
        "across": np.pad(across(*half_space, profile.counted, skin.anisotropy), ((0, 0), (0, 1))),
    }


def _relief_band(maps: Maps) -> float:
    """Mip of a larger height map that matches the normal map: it adds only finer relief. -1: it adds all."""
    if maps.normal is None or maps.height is None:
        return _NO_BAND
    finer = max(maps.height.shape[:2]) / max(maps.normal.shape[:2])
    return float(np.log2(finer)) if finer > 1 else _NO_BAND
