"""The lamps of an image: a rig of the package, or key, fill and rim as they are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, lru_cache
from math import cos, pi, radians, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.spec_tables import RIG
from dermis.images.colour import luminance
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights
from dermis.scene.lights import Light, RectangleLight, preset_lights

_SECOND_NM_K = 1.438777e7  # hc / k
_WHITE_K = 6500.0
_PLACES = "position", "target", "direction", "up"
_LAMPS = "key", "fill", "rim"


def lights_of(parameters: Mapping[str, Any]) -> tuple[Light, ...]:
    """The lights of an image by its parameters."""
    kind, strength, turn = (parameters[f"light.{name}"] for name in ("kind", "strength", "turn_deg"))
    if not strength:
        return ()
    if kind == RIG:
        return tuple(_lamp(parameters, f"light.{lamp}.", turn, strength) for lamp in _LAMPS)
    return tuple(_turned(one, turn, strength) for one in _preset(kind))


def towards(yaw_deg: float, pitch_deg: float) -> tuple[float, float, float]:
    """The unit vector that points so far to the head's left of its front, and so far above it."""
    yaw, pitch = radians(yaw_deg), radians(pitch_deg)
    return sin(yaw) * cos(pitch), sin(pitch), cos(yaw) * cos(pitch)


@lru_cache(maxsize=64)
def colour_of(kelvin: float) -> tuple[float, float, float]:
    """A black body's light by Planck's law, linear Rec. 709 of luminance 1; white at 6500 K."""
    white, own = (np.expm1(_SECOND_NM_K / (WAVELENGTHS_NM * one)) for one in (_WHITE_K, kelvin))
    colour = np.maximum(_weights() @ (white / own), 0.0)
    red, green, blue = map(float, colour / luminance(colour))
    return red, green, blue


@cache
def _weights() -> NDArray[np.float64]:
    """Matrix (3, n) from spectra, which are relative to white's, to colours."""
    return rgb_weights()


def _lamp(parameters: Mapping[str, Any], lamp: str, turn_deg: float, strength: float) -> Light:
    """A lamp of the rig, by the parameters that begin with its name."""
    distance, size = parameters[f"{lamp}distance_mm"], parameters[f"{lamp}size_mm"]
    x, y, z = towards(parameters[f"{lamp}yaw_deg"] + turn_deg, parameters[f"{lamp}pitch_deg"])
    much = pi * strength * parameters[f"{lamp}strength"]
    red, green, blue = (much * one for one in colour_of(parameters[f"{lamp}kelvin"]))
    return RectangleLight(
        position=(distance * x, distance * y, distance * z),
        irradiance=(red, green, blue),
        width_mm=size,
        height_mm=size,
    )


@cache
def _preset(kind: str) -> tuple[Light, ...]:
    return preset_lights(kind)


def _turned(light: Light, degrees: float, strength: float) -> Light:
    """A light of another strength, turned about the upward axis."""
    sine, cosine = sin(radians(degrees)), cos(radians(degrees))
    values: dict[str, Any] = {"irradiance": tuple(strength * one for one in light.irradiance)}
    for name in _PLACES:
        if hasattr(light, name):
            x, y, z = getattr(light, name)
            values[name] = (cosine * x + sine * z, y, cosine * z - sine * x)
    return light.replace(**values)
