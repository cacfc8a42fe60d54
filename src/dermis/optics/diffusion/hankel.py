"""Numerical inverse Hankel transform of radial profiles, on log-spaced grids of frequencies and radii."""

from __future__ import annotations

from functools import cache

import numpy as np

from dermis.optics.media import Floats

TRANSFORM_SAMPLE_COUNT = 2048
_FREQUENCY_DECADES = 16.0
_CENTRE_FREQUENCY_PER_MM = 10.0  # skin scatters over tenths of a millimetre
_LOG_FREQUENCY_STEP = _FREQUENCY_DECADES * np.log(10.0) / TRANSFORM_SAMPLE_COUNT

NEAR_ZERO_FREQUENCY = np.array([1e-8])
"""Frequency (1,) near 0, where the Hankel transform of a profile equals its total reflectance [1/mm]."""


@cache
def transform_frequencies() -> Floats:
    """Return the log-spaced frequencies at which `inverse_transform` expects its input [1/mm].

    The shape is (TRANSFORM_SAMPLE_COUNT,).
    """
    return np.asarray(
        _CENTRE_FREQUENCY_PER_MM
        * np.exp(
            _LOG_FREQUENCY_STEP * (np.arange(TRANSFORM_SAMPLE_COUNT) - (TRANSFORM_SAMPLE_COUNT - 1) / 2.0)
        )
    )


@cache
def transform_radii() -> Floats:
    """Return the log-spaced radii r at which `inverse_transform` returns R(r) [mm].

    The shape is (TRANSFORM_SAMPLE_COUNT,).
    """
    return np.asarray(np.exp(_log_radius_offset()) / transform_frequencies()[::-1])


def inverse_transform(transform: Floats) -> Floats:
    """Return R(r), (TRANSFORM_SAMPLE_COUNT, c), at `transform_radii` from its Hankel transform [1/mm2].

    transform : (TRANSFORM_SAMPLE_COUNT, c) Hankel transform of R(r) at `transform_frequencies` [-]

    The relative error is 1e-8 where R(r) is within six decades of its maximum; elsewhere the error is 1e-9 of
    the maximum.

    Source: [Hamilton2000], a fast Fourier transform in the logarithm of the frequency.
    """
    from scipy.fft import fht

    weighted = transform * transform_frequencies()[:, None] / (2.0 * np.pi)
    scaled = fht(np.ascontiguousarray(weighted.T), _LOG_FREQUENCY_STEP, mu=0.0, offset=_log_radius_offset())
    return np.asarray(scaled.T / transform_radii()[:, None])


@cache
def _log_radius_offset() -> float:
    from scipy.fft import fhtoffset

    return float(fhtoffset(_LOG_FREQUENCY_STEP, mu=0.0))
