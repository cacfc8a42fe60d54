"""Between a radial profile and its Hankel transform, on logarithmic grids."""

from __future__ import annotations

from functools import cache

import numpy as np

from dermis.optics.media import Floats

COUNT = 2048
_DECADES = 16.0
_CENTRE_PER_MM = 10.0  # skin scatters over tenths of a millimetre
_STEP = _DECADES * np.log(10.0) / COUNT

STILL = np.array([1e-8])
"""A frequency low enough to stand for 0, where a transform is the total [1/mm]."""


@cache
def frequencies() -> Floats:
    """The frequencies s that `to_radius` expects, (COUNT,) log-spaced [1/mm]."""
    return np.asarray(_CENTRE_PER_MM * np.exp(_STEP * (np.arange(COUNT) - (COUNT - 1) / 2.0)))


@cache
def radii() -> Floats:
    """The radii that `to_radius` gives back, (COUNT,) log-spaced [mm]."""
    return np.asarray(np.exp(_offset()) / frequencies()[::-1])


def to_radius(transform: Floats) -> Floats:
    """R(r) at `radii` from its transform at `frequencies`, (COUNT, c) both [1/mm2].

    Exact to 1e-8 of the value over six decades of it, and to 1e-9 of the largest value below that.

    Source: [Hamilton2000], a fast Fourier transform in the logarithm of s.
    """
    from scipy.fft import fht

    weighted = transform * frequencies()[:, None] / (2.0 * np.pi)
    rings = fht(np.ascontiguousarray(weighted.T), _STEP, mu=0.0, offset=_offset())
    return np.asarray(rings.T / radii()[:, None])


@cache
def _offset() -> float:
    from scipy.fft import fhtoffset

    return float(fhtoffset(_STEP, mu=0.0))
