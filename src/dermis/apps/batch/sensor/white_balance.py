"""White balance in the colour space of the sensor."""

from __future__ import annotations

from functools import cache

import numpy as np

from dermis.apps.batch.lighting import WHITE_TEMPERATURE_K, blackbody_colour
from dermis.apps.batch.sensor.model import Sensor
from dermis.base.arrays import Doubles
from dermis.images.colour import XYZ_OF_REC709, luminance
from dermis.images.colour_spaces import BRADFORD_MATRIX

Colour = tuple[float, float, float]
_COLOUR_DECIMALS = 12
_MIRED_K = 1e6  # a colour temperature of T kelvin is 1e6 / T mired


@cache
def sensor_matrix() -> Doubles:
    """Return the matrix (3, 3) from linear Rec. 709 to the signals of the sensor, with white at (1, 1, 1).

    The channels of the sensor are the sharpened cone responses of Bradford. No colour of Rec. 709 has a
    signal below 0, and even light without any blue of Rec. 709 has a signal in all three channels.

    Source: [Lam1985].
    """
    matrix = BRADFORD_MATRIX @ XYZ_OF_REC709
    return np.asarray(matrix / matrix.sum(axis=1, keepdims=True))


def assumed_white(sensor: Sensor, light_colour: Colour | None) -> Colour:
    """Return the linear Rec. 709 colour, with luminance 1, of the light that the camera assumes.

    light_colour : colour of the lights of the scene, needed for the white balance "lights"
    """
    if sensor.white_balance == "lights":
        assert light_colour is not None
        white = sensor_matrix() @ light_colour
    else:
        white = sensor_matrix() @ blackbody_colour(sensor.white_kelvin)
    shifted_kelvin = _MIRED_K / (_MIRED_K / WHITE_TEMPERATURE_K + sensor.white_error_mired)
    white *= sensor_matrix() @ blackbody_colour(shifted_kelvin)
    white[1] *= 2.0**-sensor.tint_error_stops
    colour = np.linalg.solve(sensor_matrix(), white)
    red, green, blue = map(float, np.round(colour / luminance(colour), _COLOUR_DECIMALS) + 0.0)
    return red, green, blue


def lamp_appearance(sensor: Sensor, lamp_kelvin: float) -> Doubles:
    """Return the linear Rec. 709 colour (3,) of a white surface in the light of a lamp, after white balance.

    lamp_kelvin : colour temperature of the lamp [K]
    """
    light = sensor_matrix() @ blackbody_colour(lamp_kelvin)
    balanced = white_balance_gains(assumed_white(sensor, blackbody_colour(lamp_kelvin))) * light
    return np.asarray(np.linalg.solve(sensor_matrix(), balanced))


def white_balance_gains(white: Colour) -> Doubles:
    """Return the gains (3,) of the sensor's channels that make light of a colour white, with its luminance.

    white : linear Rec. 709 colour with luminance 1, from `assumed_white`
    """
    return np.asarray(1.0 / (sensor_matrix() @ white))
