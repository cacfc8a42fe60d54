"""Conversion between sRGB and linear Rec. 709, luminance, and colour differences (CIEDE2000)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.arrays import Bytes, Doubles, Floats

REC709_LUMINANCE = (0.2126, 0.7152, 0.0722)
XYZ_OF_REC709 = np.array(
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923], [0.0193308, 0.1191948, 0.9505322]]
)
_WHITE_XYZ = XYZ_OF_REC709.sum(axis=1)
_CIELAB_DELTA = 6.0 / 29.0  # constant delta of the CIELAB function


def encode_srgb(linear_values: ArrayLike) -> NDArray[np.floating]:
    """Convert linear values to sRGB by the exact piecewise curve, neither clipped nor rounded [-].

    linear_values : any shape; float32 stays float32, all other types become float64
    """
    value = _as_float(linear_values)
    # The power branch is computed everywhere, so its argument is clamped where the linear branch is used.
    curve = 1.055 * np.maximum(value, 0.0031308) ** (1 / 2.4) - 0.055
    return np.asarray(np.where(value <= 0.0031308, 12.92 * value, curve))


def decode_srgb(srgb_values: ArrayLike) -> NDArray[np.floating]:
    """Convert sRGB values to linear values by the exact piecewise curve, not clipped [-].

    srgb_values : any shape; float32 stays float32, all other types become float64
    """
    value = _as_float(srgb_values)
    curve = ((np.maximum(value, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.asarray(np.where(value <= 0.04045, value / 12.92, curve))


def encode_srgb8(linear_values: ArrayLike) -> Bytes:
    """Convert linear values to 8-bit sRGB levels, rounded to nearest.

    linear_values : any shape; clipped to [0, 1], NaN becomes 0
    """
    value = np.clip(np.nan_to_num(_as_float(linear_values), nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    return np.asarray(np.rint(encode_srgb(value) * 255.0).astype(np.uint8))


def decode_srgb_levels(srgb_levels: Bytes | NDArray[np.uint16]) -> Floats:
    """Convert 8- or 16-bit sRGB levels of any shape to linear values from 0 to 1, by table lookup."""
    return _linear_by_level(np.iinfo(srgb_levels.dtype).max + 1)[srgb_levels]


def luminance(linear_colours: ArrayLike) -> NDArray[np.floating]:
    """Return the relative luminance Y (...) of linear Rec. 709 colours [-].

    linear_colours : (..., 3) or, with alpha, which is ignored, (..., 4)
    """
    colour = _as_float(linear_colours)[..., :3]
    return colour @ np.asarray(REC709_LUMINANCE, colour.dtype)


@lru_cache(maxsize=2)
def _linear_by_level(level_count: int) -> Floats:
    table = decode_srgb(np.arange(level_count) / (level_count - 1)).astype(np.float32)
    table.flags.writeable = False
    return table


def _as_float(numbers: ArrayLike) -> NDArray[np.floating]:
    array = np.asarray(numbers)
    return array if array.dtype == np.float32 else array.astype(np.float64)


def lab(linear_colours: ArrayLike) -> Doubles:
    """Convert linear Rec. 709 colours (..., 3) to CIE L*a*b* (..., 3) with the white point D65."""
    t = np.asarray(linear_colours, np.float64) @ XYZ_OF_REC709.T / _WHITE_XYZ
    f = np.where(t > _CIELAB_DELTA**3, np.cbrt(t), t / (3.0 * _CIELAB_DELTA**2) + 4.0 / 29.0)
    X, Y, Z = np.moveaxis(f, -1, 0)
    return np.stack([116.0 * Y - 16.0, 500.0 * (X - Y), 200.0 * (Y - Z)], axis=-1)


def linear_of_xyz(xyz_over_white: ArrayLike) -> Doubles:
    """Convert CIE XYZ under any light to the linear Rec. 709 colours (..., 3) with the same L*a*b* under D65.

    xyz_over_white : (..., 3) X, Y and Z of the colours, divided by X, Y and Z of white in the same light
    """
    xyz = np.asarray(xyz_over_white, np.float64) * _WHITE_XYZ
    return np.asarray(xyz @ np.linalg.inv(XYZ_OF_REC709).T)


def linear_of_lab(cielab: ArrayLike) -> Doubles:
    """Convert CIE L*a*b* colours (..., 3) with the white point D65 to linear Rec. 709, not clipped."""
    L, a, b = np.moveaxis(np.asarray(cielab, np.float64), -1, 0)
    y = (L + 16.0) / 116.0
    f = np.stack([y + a / 500.0, y, y - b / 200.0], axis=-1)
    linear_part = 3.0 * _CIELAB_DELTA**2 * (f - 4.0 / 29.0)
    return linear_of_xyz(np.where(f > _CIELAB_DELTA, f**3, linear_part))


def delta_e_2000(first_colours: ArrayLike, second_colours: ArrayLike) -> Doubles:
    """Return the CIEDE2000 colour difference (...) of two arrays of linear Rec. 709 colours (..., 3).

    A colour difference of 1 is just noticeable.

    Source: [Sharma2005].
    """
    (L1, a1, b1), (L2, a2, b2) = (np.moveaxis(lab(one), -1, 0) for one in (first_colours, second_colours))
    mean_chroma = 0.5 * (np.hypot(a1, b1) + np.hypot(a2, b2))
    stretch = 1.5 - 0.5 * _chroma_term(mean_chroma)
    C1, C2 = np.hypot(stretch * a1, b1), np.hypot(stretch * a2, b2)
    h1, h2 = (np.degrees(np.arctan2(b, stretch * a)) % 360.0 for a, b in ((a1, b1), (a2, b2)))
    grey = C1 * C2 == 0.0
    turn = np.where(grey, 0.0, (h2 - h1 + 180.0) % 360.0 - 180.0)
    wraps = np.abs(h1 - h2) > 180.0
    opposite = np.where(wraps, np.where(h1 + h2 < 360.0, 180.0, -180.0), 0.0)
    hue = np.where(grey, h1 + h2, 0.5 * (h1 + h2) + opposite)
    L, C = 0.5 * (L1 + L2), 0.5 * (C1 + C2)
    lightness = (L2 - L1) / (1.0 + 0.015 * (L - 50.0) ** 2 / np.sqrt(20.0 + (L - 50.0) ** 2))
    chroma = (C2 - C1) / (1.0 + 0.045 * C)
    tint = 2.0 * np.sqrt(C1 * C2) * np.sin(np.radians(turn / 2.0)) / (1.0 + 0.015 * C * _hue_weight(hue))
    rotation = -np.sin(np.radians(60.0 * np.exp(-(((hue - 275.0) / 25.0) ** 2)))) * 2.0 * _chroma_term(C)
    return np.asarray(np.sqrt(lightness**2 + chroma**2 + tint**2 + rotation * chroma * tint))


def _chroma_term(chroma: Doubles) -> Doubles:
    return np.asarray(np.sqrt(chroma**7 / (chroma**7 + 25.0**7)))


def _hue_weight(hue: Doubles) -> Doubles:
    terms = ((-0.17, 1.0, -30.0), (0.24, 2.0, 0.0), (0.32, 3.0, 6.0), (-0.20, 4.0, -63.0))
    cosines = (weight * np.cos(np.radians(factor * hue + shift)) for weight, factor, shift in terms)
    return np.asarray(1.0 + sum(cosines))
