"""The sRGB transfer curve and luminance; every linear colour is Rec. 709."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

REC709_LUMINANCE = (0.2126, 0.7152, 0.0722)


def encode_srgb(linear: ArrayLike) -> NDArray[np.floating[Any]]:
    """sRGB values [-] of linear ones by the exact piecewise curve, neither clipped nor rounded.

    linear : any shape; float32 stays float32, everything else becomes float64
    """
    value = _as_float(linear)
    # The power branch is computed everywhere: clamp it where the linear segment is taken.
    curve = 1.055 * np.maximum(value, 0.0031308) ** (1 / 2.4) - 0.055
    return np.asarray(np.where(value <= 0.0031308, 12.92 * value, curve))


def decode_srgb(encoded: ArrayLike) -> NDArray[np.floating[Any]]:
    """Linear values [-] of sRGB ones in 0..1 by the exact piecewise curve, not clipped.

    encoded : any shape; float32 stays float32, everything else becomes float64
    """
    value = _as_float(encoded)
    curve = ((np.maximum(value, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.asarray(np.where(value <= 0.04045, value / 12.92, curve))


def encode_srgb8(linear: ArrayLike) -> NDArray[np.uint8]:
    """Grey levels 0..255 of linear values, rounded to nearest.

    linear : any shape; clipped to 0..1, NaN becomes 0
    """
    value = np.clip(np.nan_to_num(_as_float(linear), nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    return np.asarray(np.rint(encode_srgb(value) * 255.0).astype(np.uint8))


def decode_srgb_levels(levels: NDArray[np.uint8] | NDArray[np.uint16]) -> NDArray[np.float32]:
    """Linear values [-] of 8- or 16-bit sRGB grey levels of any shape, read from a table."""
    return _linear_of_level(np.iinfo(levels.dtype).max + 1)[levels]


def luminance(linear: ArrayLike) -> NDArray[np.floating[Any]]:
    """Relative luminance Y [-] of linear Rec. 709 colours.

    linear : (..., 3) or (..., 4), whose alpha is ignored
    """
    colour = _as_float(linear)[..., :3]
    return colour @ np.asarray(REC709_LUMINANCE, colour.dtype)


@lru_cache(maxsize=2)
def _linear_of_level(count: int) -> NDArray[np.float32]:
    table = decode_srgb(np.arange(count) / (count - 1)).astype(np.float32)
    table.flags.writeable = False
    return table


def _as_float(values: ArrayLike) -> NDArray[np.floating[Any]]:
    array = np.asarray(values)
    return array if array.dtype == np.float32 else array.astype(np.float64)
