"""Positions of samples in a pixel."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray


@cache
def pixel_samples(count: int) -> NDArray[np.float64]:
    """(count, 2) places in the unit square: Hammersley's set, even in both axes for any count."""
    index = np.arange(count)
    y, digit, rest = np.zeros(count), 0.5, index.copy()
    while rest.any():
        y += digit * (rest & 1)
        rest >>= 1
        digit /= 2
    places = np.stack([(index + 0.5) / count, y + 0.5 / count], axis=-1) % 1.0
    places.flags.writeable = False
    return places
