"""Lights of an image: a preset rig, or sampled key, fill and rim lamps."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, lru_cache
from math import cos, pi, radians, sin

import numpy as np

from dermis.apps.batch.sampling import Parameters, round_significant, table_numbers
from dermis.apps.batch.spec_tables import LAMP_RIG
from dermis.environment.panorama import load_panorama, mean_radiance
from dermis.images.colour import luminance
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights
from dermis.scene.lights import Light, RectangleLight, preset_lights
from dermis.scene.model import Scene

_PLANCK_C2_NM_K = 1.438777e7  # second radiation constant, hc / k
WHITE_TEMPERATURE_K = 6500.0
"""Temperature of a black body that is white in Rec. 709 [K]."""
_LIGHT_VECTOR_FIELDS = "position", "target", "direction", "up"
LAMP_NAMES = "key", "fill", "rim"
_rgb_weights = cache(rgb_weights)


def sampled_lights(parameters: Parameters) -> tuple[Light, ...]:
    """Return the lights of an image from its sampled parameters."""
    light = table_numbers(parameters, "light")
    strength, turn_deg = light["strength"], light["turn_deg"]
    if not strength:
        return ()
    if parameters["light.kind"] == LAMP_RIG:
        lamps = (table_numbers(parameters, f"light.{lamp}") for lamp in LAMP_NAMES)
        return tuple(_area_lamp(lamp, turn_deg, strength) for lamp in lamps)
    presets = _preset_lights(str(parameters["light.kind"]))
    return tuple(_rotate_light(light, turn_deg, strength) for light in presets)


def direction_from_angles(yaw_deg: float, pitch_deg: float) -> tuple[float, float, float]:
    """Return the unit vector for two angles: yaw from the head's front to its left, and pitch upwards."""
    yaw, pitch = radians(yaw_deg), radians(pitch_deg)
    return sin(yaw) * cos(pitch), sin(pitch), cos(yaw) * cos(pitch)


@lru_cache(maxsize=64)
def blackbody_colour(temperature_k: float) -> tuple[float, float, float]:
    """Return the colour of a black body in linear Rec. 709 with luminance 1; at 6500 K, it is white.

    temperature_k : temperature [K]
    """
    white, body = (
        np.expm1(_PLANCK_C2_NM_K / (WAVELENGTHS_NM * T)) for T in (WHITE_TEMPERATURE_K, temperature_k)
    )
    colour = np.maximum(_rgb_weights() @ (white / body), 0.0)
    red, green, blue = map(float, colour / luminance(colour))
    return red, green, blue


def light_colour(scene: Scene) -> tuple[float, float, float]:
    """Return the linear Rec. 709 colour of all light of a scene with luminance 1, rounded to six digits.

    It is the colour of the sum of the irradiances on surfaces that face each light, and of the mean
    irradiance by the environment; white without light.
    """
    total = np.sum([light.irradiance for light in scene.lights] or [(0.0, 0.0, 0.0)], axis=0)
    if scene.environment is not None:
        mean = np.array(_mean_panorama_radiance(scene.environment.name))
        total = total + pi * scene.environment.exposure * mean
    brightness = float(luminance(total))
    colour = total / brightness if brightness > 0.0 else np.ones(3)
    red, green, blue = map(round_significant, map(float, colour))
    return red, green, blue


@lru_cache(maxsize=64)
def _mean_panorama_radiance(panorama_name: str) -> tuple[float, float, float]:
    red, green, blue = map(float, mean_radiance(load_panorama(panorama_name)))
    return red, green, blue


def _area_lamp(lamp_parameters: Mapping[str, float], rig_turn_deg: float, rig_strength: float) -> Light:
    """Return a lamp of a sampled rig: a square area light that faces the centre of the head.

    lamp_parameters : sampled parameters of the lamp, by key of `LampTable`
    rig_turn_deg : rotation of the rig about the upward axis [degrees]
    rig_strength : factor of the irradiance, common to all lamps [-]
    """
    x, y, z = direction_from_angles(lamp_parameters["yaw_deg"] + rig_turn_deg, lamp_parameters["pitch_deg"])
    distance, size, irradiance = (
        lamp_parameters["distance_mm"],
        lamp_parameters["size_mm"],
        pi * rig_strength * lamp_parameters["strength"],
    )
    red, green, blue = (irradiance * one for one in blackbody_colour(lamp_parameters["kelvin"]))
    position = distance * x, distance * y, distance * z
    return RectangleLight(position=position, irradiance=(red, green, blue), width_mm=size, height_mm=size)


@cache
def _preset_lights(preset_name: str) -> tuple[Light, ...]:
    return preset_lights(preset_name)


def _rotate_light(light: Light, turn_deg: float, rig_strength: float) -> Light:
    """Return a light of a preset rig, rotated about the upward axis.

    turn_deg : rotation angle [degrees]
    rig_strength : factor by which the light's irradiance is multiplied [-]
    """
    sine, cosine = sin(radians(turn_deg)), cos(radians(turn_deg))
    values: dict[str, object] = {"irradiance": tuple(rig_strength * one for one in light.irradiance)}
    for name in _LIGHT_VECTOR_FIELDS:
        if hasattr(light, name):
            x, y, z = getattr(light, name)
            values[name] = (cosine * x + sine * z, y, cosine * z - sine * x)
    return light.replace(**values)
