"""Outputs of a frame as colours, to look at."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.images.colour import encode_srgb8
from dermis.scene.outputs import OUTPUTS

_LIGHT = {"albedo": 1.0, "irradiance": 1 / np.pi, "diffuse": 1.0, "specular": 1.0, "translucent": 4.0}
_COLOURS = 8192
_RANGE = 0.02, 0.98  # quantiles of what is seen that are black and white


def coloured(name: str, values: NDArray[Any]) -> NDArray[np.uint8]:
    """(h, w, 3) bytes: light as it looks, a colour for each whole number, else dark to bright.

    values : (h, w) or (h, w, c) of the output
    """
    if name in _LIGHT:
        return encode_srgb8(_LIGHT[name] * values)
    if OUTPUTS[name].kind != "float32":
        colours = np.random.default_rng(8).integers(40, 255, (_COLOURS, 3), np.uint8)
        colours = colours[values.astype(int) % _COLOURS]
        return np.where((values != OUTPUTS[name].background)[..., None], colours, np.uint8(0))
    each = values.reshape(*values.shape[:2], -1)[..., :3]
    seen = (each != 0).any(axis=-1)
    low, high = np.quantile(each[seen], _RANGE, axis=0)
    levels = np.clip((each - low) / np.maximum(high - low, 1e-6), 0.0, 1.0) * seen[..., None]
    if levels.shape[2] == 1:
        levels = levels.repeat(3, axis=2)
    wide = np.pad(levels, ((0, 0), (0, 0), (0, 3 - levels.shape[2])))
    return np.asarray(np.rint(255 * wide), np.uint8)
