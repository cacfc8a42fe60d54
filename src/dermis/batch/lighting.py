"""The lamps of an image: a rig of the package, or key, fill and rim as they are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from math import cos, expm1, pi, radians, sin
from typing import Any

import numpy as np

from dermis.batch.tables import RIG
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights
from dermis.scene.lights import Light, RectangleLight, preset_lights

_SECOND_NM_K = 1.438777e7  # hc / k
_WHITE_K = 6500.0
_PLACES = "position", "target", "direction", "up"
_LAMPS = "key", "fill", "rim"


def lights_of(parameters: Mapping[str, Any]) -> tuple[Light, ...]:
    """The lights of an image by its parameters."""
    kind, strength = parameters["light.kind"], parameters["light.strength"]
    if not strength:
        return ()
    lights = tuple(map(_lamp(parameters), _LAMPS)) if kind == RIG else preset_lights(kind)
    return tuple(_turned(one, parameters["light.turn_deg"], strength) for one in lights)


def towards(yaw_deg: float, pitch_deg: float) -> tuple[float, float, float]:
    """The unit vector that points so far to the head's left of its front, and so far above it."""
    yaw, pitch = radians(yaw_deg), radians(pitch_deg)
    return sin(yaw) * cos(pitch), sin(pitch), cos(yaw) * cos(pitch)


@cache
def colour_of(kelvin: float) -> tuple[float, float, float]:
    """A black body's light, linear Rec. 709 of luminance 1; white at 6500 K."""
    red, green, blue = np.maximum(rgb_weights() @ _planck(kelvin), 0.0)
    grey = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    return float(red / grey), float(green / grey), float(blue / grey)


def _planck(kelvin: float) -> np.ndarray[Any, Any]:
    """Planck's law over that of white, as the weights take an even spectrum to be white."""
    return np.array([_bent(nm, _WHITE_K) / _bent(nm, kelvin) for nm in WAVELENGTHS_NM])


def _bent(nm: float, kelvin: float) -> float:
    return expm1(_SECOND_NM_K / (nm * kelvin))


def _lamp(parameters: Mapping[str, Any]) -> Any:
    def made(lamp: str) -> Light:
        told = {key: parameters[f"light.{lamp}.{key}"] for key in _KEYS}
        way = towards(told["yaw_deg"], told["pitch_deg"])
        x, y, z = (told["distance_mm"] * one for one in way)
        red, green, blue = (pi * told["strength"] * one for one in colour_of(told["kelvin"]))
        size = told["size_mm"]
        return RectangleLight(
            position=(x, y, z), irradiance=(red, green, blue), width_mm=size, height_mm=size
        )

    return made


_KEYS = "yaw_deg", "pitch_deg", "distance_mm", "size_mm", "strength", "kelvin"


def _turned(light: Light, degrees: float, strength: float) -> Light:
    """A light of another strength, turned about the upward axis."""
    sine, cosine = sin(radians(degrees)), cos(radians(degrees))
    values: dict[str, Any] = {"irradiance": tuple(strength * one for one in light.irradiance)}
    for name in _PLACES:
        if hasattr(light, name):
            x, y, z = getattr(light, name)
            values[name] = (cosine * x + sine * z, y, cosine * z - sine * x)
    return light.replace(**values)
