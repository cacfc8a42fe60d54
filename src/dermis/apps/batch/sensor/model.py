"""Parameters of a digital camera, from its lens to the compression of its pictures."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import FrozenModel

MIN_DEMOSAICED_SIDE = 2
"""Least width and height of a picture with a colour filter array [pixel]: those of its pattern."""


class Sensor(FrozenModel):
    """Sensor and processing of a digital camera. The defaults leave a picture unchanged.

    Examples
    --------
    >>> from dermis.dataset import Sensor
    >>> Sensor(iso=800, demosaicing="malvar").full_well_electrons
    10000.0
    """

    vignetting: Annotated[float, Field(ge=0, le=10), BoundsReason("0 is none, 1 the natural one")] = 0.0
    """Decrease of light towards the corners: the light is multiplied by the cosine of the angle between ray
    and optical axis to the power of four times this number."""
    white_balance: Literal["kelvin", "lights"] = "kelvin"
    """Colour of light that the camera renders as white: that of `white_kelvin`, or that of all lights of the
    scene together (automatic white balance)."""
    white_kelvin: Annotated[float, Field(ge=1700, le=20_000), BoundsReason("K: candle to blue sky")] = 6500.0
    """Colour temperature for the white balance "kelvin"; at 6500, colours are unchanged [K]."""
    white_error_mired: Annotated[
        float, Field(ge=-100, le=100), BoundsReason("mired: 100 is the difference of 6500 K and 3939 K")
    ] = 0.0
    """Error of the white balance on the scale of inverse colour temperatures: above 0, the camera assumes
    redder light, and the picture becomes bluer [mired]."""
    tint_error_stops: Annotated[float, Field(ge=-1, le=1), BoundsReason("1 is twice the green")] = 0.0
    """Error of the gain of green: above 0, the picture becomes greener [stops]."""
    iso: Annotated[float, Field(ge=0, le=51_200), BoundsReason("0 is a sensor without noise")] = 0.0
    """Sensitivity; the sensor saturates at full_well_electrons times 100 / iso electrons. 0 for a sensor
    without noise."""
    full_well_electrons: Annotated[
        float, Field(ge=500, le=90_000), BoundsReason("electrons: from the smallest pixels to the largest")
    ] = 10_000.0
    """Number of electrons at which a pixel saturates at ISO 100; about 6000 for phones, and 50,000 for
    large sensors."""
    read_noise_electrons: Annotated[float, Field(ge=0, le=50), BoundsReason("electrons")] = 2.0
    """Standard deviation of the noise of the read-out, unless `iso` is 0 [electrons]."""
    headroom_stops: Annotated[float, Field(ge=0, le=4), BoundsReason("stops")] = 1.0
    """Range of the sensor above the white of the picture [stops]."""
    demosaicing: Literal["none", "bilinear", "malvar"] = "none"
    """Colour filter array (RGGB) and its interpolation: bilinear, or gradient-corrected after Malvar et al.;
    "none" for a sensor that measures three colours at each pixel."""
    tone_curve: Literal["srgb", "phone"] = "srgb"
    """Curve from light to levels: that of sRGB, or one with contrast and shoulder, as phones have."""
    contrast: Annotated[float, Field(ge=0.5, le=2), BoundsReason("1 is the contrast of sRGB")] = 1.2
    """Slope of the curve "phone" at middle grey, relative to that of sRGB [-]."""
    shoulder: Annotated[float, Field(ge=0, le=0.9), BoundsReason("0 clips at white")] = 0.5
    """Part of the range below white in which the curve "phone" compresses highlights; the level 255 then
    corresponds to the saturation of the sensor [-]."""
    jpeg_quality: Annotated[float, Field(ge=0, le=100), BoundsReason("0 is no compression")] = 0.0
    """Quality of JPEG, rounded to a whole number, with colours at half resolution; 0 for no compression."""
