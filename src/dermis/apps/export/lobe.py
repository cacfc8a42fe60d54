"""Burley's lobe R(r) = A (exp(-r/d) + exp(-r/3d)) / (8 pi d r), which most engines have, and its fit."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.curve import Curve
from dermis.optics.fits.burley import BurleyProfile
from dermis.optics.media import Floats

_HALF = 1.58  # radius within which half of the light leaves, by d
_FACTOR = 30.0  # between the width that fits the median alone and any that is tried
_HALVINGS = 40
_THINNEST_MM = 1e-9


def lobe(d_mm: ArrayLike, energy: ArrayLike) -> Curve:
    """The curve of a lobe of a width d for each channel.

    d_mm : (3,) above 0 [mm]
    energy : (3,) A [-]
    """
    d = np.maximum(np.asarray(d_mm, np.float64), _THINNEST_MM)
    return Curve.of(BurleyProfile(np.ones(3), 1.0 / d).within, energy)


def fit_d(curve: Curve) -> Floats:
    """Widths d (3,) of the lobes whose cumulative profiles differ least from the curve at their worst [mm].

    A wider lobe has less light within each radius, so its largest surplus falls with d and its largest lack
    grows: where they are equal, the difference is least. Least squares would weigh radii as they are spaced.
    """
    return np.array([_fit(curve.radii_mm, curve.share[:, i]) for i in range(3)])


def _fit(radius_mm: Floats, share: Floats) -> float:
    middle = np.log(np.interp(0.5, share, radius_mm) / _HALF)
    low, high = middle - np.log(_FACTOR), middle + np.log(_FACTOR)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        one = BurleyProfile(np.ones(1), np.exp(np.array([-middle])))
        surplus = one.within(radius_mm)[:, 0] - share
        low, high = (middle, high) if surplus.max() > -surplus.min() else (low, middle)
    return float(np.exp(0.5 * (low + high)))
