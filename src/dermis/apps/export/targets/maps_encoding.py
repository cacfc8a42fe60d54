"""Maps as OpenEXR and PNG, and what a reader must know to take the PNG for numbers."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.targets.maps_meaning import Meaning
from dermis.images.colour import encode_srgb8
from dermis.images.io import encode_exr_parts

Floats = NDArray[np.float32]
NormalY = Literal["up", "down"]
_MOST, _BRIGHT = 65535, 99.9


def exr(name: str, values: Floats) -> bytes:
    """A map as OpenEXR: channels R, G, B of colours and vectors, Y of one number."""
    letters = "Y" if values.ndim == 2 else "RGB"
    channels = [values] if values.ndim == 2 else list(np.moveaxis(values, -1, 0))
    return encode_exr_parts({name: dict(zip(letters, channels, strict=True))}, swift=True)


def levels(values: Floats, meaning: Meaning) -> tuple[NDArray[np.uint8 | np.uint16], dict[str, Any]]:
    """A map as a PNG has it, and how its levels become numbers."""
    if meaning.shown == "colour":
        return encode_srgb8(np.clip(values, 0.0, 1.0)), {"png": "sRGB"}
    if meaning.shown == "light":
        bright = float(np.percentile(values, _BRIGHT)) or 1.0
        return encode_srgb8(np.clip(values / bright, 0.0, 1.0)), {"png": "sRGB", "white": bright}
    if meaning.shown == "normal":
        return _sixteen(0.5 * values + 0.5), {"png": "value = 2 level / 65535 - 1"}
    if meaning.shown == "root":
        return _sixteen(np.sqrt(values)), {"png": "value = (level / 65535)^2"}
    if meaning.shown == "share":
        return _sixteen(values), {"png": "value = level / 65535"}
    low, high = float(values.min()), float(values.max())
    span = high - low or 1.0
    words = "value = black + level / 65535 (white - black)"
    return _sixteen((values - low) / span), {"png": words, "black": low, "white": low + span}


def with_green(normal: Floats, normal_y: NormalY) -> Floats:
    """A map of normals whose green points to row 0 ("up", OpenGL) or away from it ("down", DirectX)."""
    if normal_y == "up":
        return normal
    return normal * np.array([1.0, -1.0, 1.0], np.float32)


def _sixteen(share: Floats) -> NDArray[np.uint16]:
    return np.rint(np.clip(share, 0.0, 1.0) * _MOST).astype(np.uint16)
