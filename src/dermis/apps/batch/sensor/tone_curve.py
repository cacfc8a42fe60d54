"""Tone curves from linear light to the levels of a picture."""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Floats
from dermis.images.colour import encode_srgb

_MIDDLE_GREY = 0.18  # reflectance at which the contrast applies


def compress_highlights(linear: Floats, shoulder: float, saturation: float) -> Floats:
    """Return light whose highlights are compressed smoothly, from 0 to 1.

    Light below 1 - shoulder is unchanged; the largest light, `saturation`, becomes 1.

    shoulder : part of the range below 1 that is compressed [-]
    saturation : largest light, at least 1 [-]

    Source: [Reinhard2002 eq. 4].
    """
    light = np.clip(linear, 0.0, saturation if shoulder else 1.0)
    if not shoulder:
        return np.asarray(light)
    start = 1.0 - shoulder
    white = (saturation - start) / shoulder
    excess = np.maximum(light - start, 0.0) / shoulder
    compressed = excess * (1.0 + excess / white**2) / (1.0 + excess)
    return np.asarray(np.minimum(light, start) + shoulder * compressed)


def phone_levels(linear: Floats, contrast: float, shoulder: float, saturation: float) -> Floats:
    """Return levels from 0 to 1 on a curve with contrast and shoulder, as phones have.

    Highlights are compressed and encoded as sRGB. Two powers then change the contrast; the curve has the
    slope `contrast`, relative to sRGB, at middle grey, and maps black, middle grey and white to themselves.

    linear : light of any shape [-]
    contrast : relative slope at middle grey [-]
    shoulder, saturation : see `compress_highlights`
    """
    level = encode_srgb(compress_highlights(linear, shoulder, saturation))
    middle = float(encode_srgb(_MIDDLE_GREY))
    dark = middle * (np.minimum(level, middle) / middle) ** contrast
    bright = 1.0 - (1.0 - middle) * ((1.0 - np.maximum(level, middle)) / (1.0 - middle)) ** contrast
    return np.asarray(np.where(level < middle, dark, bright), np.float32)
