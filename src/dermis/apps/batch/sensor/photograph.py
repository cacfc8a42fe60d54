"""Photograph: the picture that a digital camera stores of a linear picture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.batch.sensor.colour_filter_array import DEMOSAICING, channel_pattern, mosaic
from dermis.apps.batch.sensor.compression import jpeg_round_trip
from dermis.apps.batch.sensor.model import MIN_DEMOSAICED_SIDE, Sensor
from dermis.apps.batch.sensor.noise import electrons_at_saturation, noisy_signal
from dermis.apps.batch.sensor.tone_curve import phone_levels
from dermis.apps.batch.sensor.vignetting import vignetting_factors
from dermis.apps.batch.sensor.white_balance import assumed_white, sensor_matrix, white_balance_gains
from dermis.base.arrays import Bytes, Doubles, Floats
from dermis.base.errors import refuse
from dermis.base.quantities import checked_array, checked_integer
from dermis.images.colour import encode_srgb8

MAX_SEED = 2**32 - 1
_MAX_LIGHT = 1e9
_MAX_MATRIX_VALUE = 1e9


class Photograph(NamedTuple):
    """Picture that a camera stores, with facts about the exposure.

    picture : (h, w, 3) sRGB bytes
    white : linear Rec. 709 colour, with luminance 1, of the light that the white balance makes white
    clipped_fraction : fraction of the pixels in which the sensor is saturated [-]
    """

    picture: Bytes
    white: tuple[float, float, float]
    clipped_fraction: float


def photograph(
    picture: ArrayLike,
    sensor: Sensor,
    *,
    K: ArrayLike | None = None,
    light_colour: ArrayLike | None = None,
    seed: int = 0,
) -> Photograph:
    """Return the picture that a digital camera stores of a linear picture.

    The light passes the lens (vignetting) and the colour filters, and is measured with noise. The signals are
    multiplied by the gains of the white balance, interpolated, converted to linear Rec. 709, encoded by the
    tone curve and compressed.

    The exposure is reduced by the smallest gain and the signals are multiplied by the gains divided by it, so
    that saturated pixels are white rather than coloured.

    Parameters
    ----------
    picture : array_like
        (h, w, 3) linear Rec. 709 after exposure, such as that of `Renderer.observe(..., linear=True)`; 1 is
        white.
    sensor : Sensor
        Parameters of the camera.
    K : array_like, optional
        (3, 3) intrinsic matrix of the camera [pixel], needed for vignetting.
    light_colour : array_like, optional
        (3,) linear Rec. 709 colour of the light, needed for the white balance "lights".
    seed : int
        Seed of the noise; equal arguments give equal pictures.

    Returns
    -------
    Photograph
        The picture as sRGB bytes, the colour that is white, and the fraction of saturated pixels.

    Raises
    ------
    DermisError
        For pictures that are not linear floats, and for missing arguments.

    Examples
    --------
    >>> import numpy as np
    >>> from dermis.dataset import Sensor, photograph
    >>> grey = np.full((64, 64, 3), 0.18, np.float32)
    >>> photograph(grey, Sensor()).picture[0, 0].tolist()
    [118, 118, 118]
    >>> photograph(grey, Sensor(iso=1600, demosaicing="malvar"), seed=1).picture.std() > 5
    True
    """
    linear = _checked_picture(picture, sensor)
    intrinsics = None if K is None else checked_array("K", K, (3, 3), -_MAX_MATRIX_VALUE, _MAX_MATRIX_VALUE)
    white = assumed_white(sensor, _checked_light_colour(sensor, light_colour))
    rng = np.random.default_rng(checked_integer("seed", seed, 0, MAX_SEED))
    exposed = _vignetted(linear, sensor, intrinsics)
    signals, clipped = _measured_signals(exposed, sensor, white_balance_gains(white), rng)
    developed = signals @ np.linalg.inv(sensor_matrix()).T.astype(np.float32)
    return Photograph(_encoded(developed, sensor), white, float(clipped.mean()))


def _vignetted(linear: Floats, sensor: Sensor, K: Doubles | None) -> Floats:
    if not sensor.vignetting:
        return linear
    if K is None:
        refuse("K", "the intrinsic matrix of the camera", "there is none", "Pass K, or set vignetting to 0")
    height, width = linear.shape[:2]
    return linear * vignetting_factors(K, (width, height), sensor.vignetting)[..., None]


def _measured_signals(
    linear: Floats, sensor: Sensor, gains: Doubles, rng: np.random.Generator
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the signals (h, w, 3) of a picture after white balance, and whether each pixel was saturated."""
    saturation, electrons = 2.0**sensor.headroom_stops, electrons_at_saturation(sensor)
    exposure = float(gains.min())
    expected = np.maximum(linear, 0.0) @ (exposure * sensor_matrix()).T.astype(np.float32)
    relative_gains = (gains / exposure).astype(np.float32)
    if sensor.demosaicing == "none":
        measured = noisy_signal(expected, saturation, electrons, sensor.read_noise_electrons, rng)
        return np.minimum(measured * relative_gains, saturation), (measured >= saturation).any(axis=2)
    measured = noisy_signal(mosaic(expected), saturation, electrons, sensor.read_noise_electrons, rng)
    balanced = measured * relative_gains[channel_pattern(*measured.shape)]
    signals = DEMOSAICING[sensor.demosaicing](np.minimum(balanced, saturation))
    return np.minimum(signals, saturation), measured >= saturation


def _encoded(linear: Floats, sensor: Sensor) -> Bytes:
    """Return linear Rec. 709 as sRGB bytes, after tone curve and compression."""
    if sensor.tone_curve == "phone":
        levels = phone_levels(linear, sensor.contrast, sensor.shoulder, 2.0**sensor.headroom_stops)
        picture = np.rint(255.0 * levels).astype(np.uint8)
    else:
        picture = encode_srgb8(linear)
    quality = round(sensor.jpeg_quality)
    return jpeg_round_trip(picture, quality) if quality else picture


def _checked_picture(picture: ArrayLike, sensor: Sensor) -> Floats:
    linear = np.asarray(picture)
    if linear.dtype.kind != "f" or linear.ndim != 3 or linear.shape[2] != 3 or not linear.size:
        actual = f"got {linear.dtype.name} of shape {linear.shape}"
        refuse("picture", "a linear picture (h, w, 3) of floats", actual, "Render with linear=True")
    if not (np.abs(linear) <= _MAX_LIGHT).all():
        refuse("picture", f"light up to {_MAX_LIGHT:g}", "it has larger numbers", "Reduce the exposure")
    if sensor.demosaicing != "none" and min(linear.shape[:2]) < MIN_DEMOSAICED_SIDE:
        expected = f"{MIN_DEMOSAICED_SIDE} x {MIN_DEMOSAICED_SIDE} pixels or more for demosaicing"
        refuse("picture", expected, f"got shape {linear.shape}", "Render a larger picture")
    return linear.astype(np.float32, copy=False)


def _checked_light_colour(
    sensor: Sensor, light_colour: ArrayLike | None
) -> tuple[float, float, float] | None:
    if light_colour is None:
        if sensor.white_balance == "lights":
            advice = 'Pass light_colour, or set white_balance to "kelvin"'
            refuse("light_colour", "the colour of the light", "there is none", advice)
        return None
    red, green, blue = checked_array("light_colour", light_colour, (3,), 0, _MAX_LIGHT).tolist()
    if not red + green + blue > 0.0:
        refuse("light_colour", "a colour above 0", "all channels are 0", "Correct it")
    return red, green, blue
