"""Pictures of where two pictures differ: even steps to the eye, and mid-grey for no difference."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.errors import refuse
from dermis.images.colour import encode_srgb, luminance

Floats = NDArray[np.float64]

MID_GREY = 0.5
"""sRGB of no difference, near the middle of the scale of lightness (L* 53)."""


def signed_difference(image: ArrayLike, truth: ArrayLike, gain: float = 4.0) -> Floats:
    """sRGB picture (h, w, 3) of image minus truth: mid-grey is none, redder is too red, lighter too light.

    image, truth : (h, w, 3) linear Rec. 709 of 0 or more; 1 is white
    gain : amplification of the difference of the sRGB values, whose steps look about even
    """
    I, T = _pair(image, truth)
    if not gain > 0:
        refuse("gain", "a number above 0", f"{gain} came", "4 shows what the eye can just see")
    difference = encode_srgb(I) - encode_srgb(T)
    return np.clip(MID_GREY + gain * difference, 0.0, 1.0)


def lightness_difference(image: ArrayLike, truth: ArrayLike) -> Floats:
    """CIE L* of the image minus that of the truth, (h, w); the eye can just see 1.

    image, truth : (h, w, 3) linear Rec. 709 of 0 or more; 1 is white
    Source: [CIE2004].
    """
    I, T = _pair(image, truth)
    return _lightness(luminance(I)) - _lightness(luminance(T))


def diverging(difference: ArrayLike, limit: float) -> Floats:
    """sRGB picture (h, w, 3) of signed numbers (h, w): blue below 0, light grey at 0, red above.

    limit : where the scale ends on both sides
    """
    from matplotlib import colormaps

    if not limit > 0:
        refuse("limit", "a number above 0", f"{limit} came", "Take the largest difference to tell apart")
    at = np.clip(0.5 + 0.5 * np.asarray(difference, np.float64) / limit, 0.0, 1.0)
    return np.asarray(colormaps["coolwarm"](at), np.float64)[..., :3]


def _lightness(Y: ArrayLike) -> Floats:
    value = np.asarray(Y, np.float64)
    small = value <= (6 / 29) ** 3
    root = np.cbrt(value)
    return np.where(small, (29 / 3) ** 3 * value, 116 * root - 16)


def _pair(image: ArrayLike, truth: ArrayLike) -> tuple[Floats, Floats]:
    I, T = np.asarray(image, np.float64), np.asarray(truth, np.float64)
    if I.shape != T.shape or I.ndim != 3 or I.shape[2] != 3:
        came = f"{I.shape} and {T.shape} came"
        refuse("difference", "two pictures of one shape (h, w, 3)", came, "Align them")
    if not (np.isfinite(I).all() and np.isfinite(T).all()):
        refuse("difference", "finite values", "others came", "Mask them out")
    return np.maximum(I, 0), np.maximum(T, 0)
