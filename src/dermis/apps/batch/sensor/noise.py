"""Noise of a sensor: shot noise of the light and noise of the read-out."""

from __future__ import annotations

from math import inf

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.sensor.model import Sensor
from dermis.base.arrays import Floats

_BASE_ISO = 100.0
_MAX_ELECTRONS = 1e9  # far above the saturation of every sensor


def electrons_at_saturation(sensor: Sensor) -> float:
    """Return the number of electrons of a saturated pixel; infinite for a sensor without noise."""
    return sensor.full_well_electrons * _BASE_ISO / sensor.iso if sensor.iso else inf


def noisy_signal(
    signal: NDArray[np.floating],
    saturation: float,
    saturation_electrons: float,
    read_noise_electrons: float,
    rng: np.random.Generator,
) -> Floats:
    """Return the signal that a sensor measures: electrons with Poisson noise, plus Gaussian noise.

    Noise can make signals negative; signals above saturation are clipped.

    signal : expected signal, of any shape [-]
    saturation : signal at which the sensor saturates [-]
    saturation_electrons : number of electrons at this signal; infinite for no noise
    read_noise_electrons : standard deviation of the Gaussian noise [electrons]

    Sources: [Foi2008], [Janesick2007].
    """
    if saturation_electrons == inf:
        return np.asarray(np.minimum(signal, saturation), np.float32)
    electrons_per_signal = saturation_electrons / saturation
    expected = np.clip(signal * electrons_per_signal, 0.0, _MAX_ELECTRONS)
    measured = rng.poisson(expected) + read_noise_electrons * rng.standard_normal(expected.shape)
    return np.asarray(np.minimum(measured / electrons_per_signal, saturation), np.float32)
