"""Curves of one shape in any size, and the size that is nearest to a curve."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.curve import Curve
from dermis.optics.media import Floats

_ROUNDS = 40
_REACH = np.log(30.0)  # of sizes about that with the same median


def resized(unit: Curve, size_mm: ArrayLike) -> Curve:
    """A curve whose lengths are in a unit, with a unit (3,) for each channel."""
    size = np.maximum(np.asarray(size_mm, np.float64), 1e-9)

    def within(radius_mm: Floats) -> Floats:
        return np.stack([unit.within(radius_mm / size[i])[:, i] for i in range(3)], axis=-1)

    return Curve.of(within, unit.energy)


def nearest_size(curve: Curve, unit: Curve) -> Floats:
    """Units (3,) with the least largest difference from a curve: surplus and lack are equal there [mm]."""
    middle = np.log(curve.radius_of(0.5) / unit.radius_of(0.5))
    low, high = middle - _REACH, middle + _REACH
    for _ in range(_ROUNDS):
        middle = 0.5 * (low + high)
        over = resized(unit, np.exp(middle)).share - curve.share
        wider = over.max(axis=0) > -over.min(axis=0)
        low, high = np.where(wider, middle, low), np.where(wider, high, middle)
    return np.asarray(np.exp(middle))
