"""A panorama as the frame reads it: irradiance of every normal, and reflections in ever rougher mirrors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.environment.harmonics import analyse, synthesise, zonal
from dermis.environment.mirrors import ROUGHEST, SMOOTHEST, round_lobe
from dermis.environment.panorama import load_panorama
from dermis.environment.suns import Sun, split_suns

Floats = NDArray[np.float64]
ROUGHNESSES = np.geomspace(SMOOTHEST, ROUGHEST, 10)
"""Of the reflections' layers, even in the logarithm, between which the shader interpolates."""
HEIGHT = 128
_DEGREE = 96  # the smoothest lobe multiplies this degree by 1e-10: no ringing around lamps


@dataclass(frozen=True)
class Prefiltered:
    """What is kept of a panorama.

    layers : (11, h, 2 h, 3) float32: irradiance by normal, then mean radiance by mirror direction
    suns : its peaks, which are not in the layers
    """

    layers: NDArray[np.float32]
    suns: tuple[Sun, ...]


def prefilter(name: str) -> Prefiltered:
    """A panorama's layers and suns; takes a quarter of a second, so nothing is kept on disk.

    name : as for `load_panorama`

    Each layer is the panorama convolved with a round kernel, exactly, in spherical harmonics of degree 96:
    no samples are drawn, so lamps leave no fireflies.

    Sources: [KautzMcCool2000] for reflections by roughness, [RamamoorthiHanrahan2001] for irradiance.
    """
    radiance, suns = split_suns(load_panorama(name))
    coefficients = analyse(radiance, _DEGREE)
    kernels = [zonal(np.cos, _DEGREE), *(mirror_kernel(float(m)) for m in ROUGHNESSES)]
    layers = [synthesise(coefficients, factors, HEIGHT) for factors in kernels]
    return Prefiltered(np.maximum(layers, 0.0).astype(np.float32), tuple(suns))


def mirror_kernel(m: float) -> Floats:
    """(97,) factors of the round lobe of roughness m, with the sum 1 over the sphere."""
    factors = zonal(lambda theta: round_lobe(theta, m), _DEGREE)
    return np.asarray(factors / factors[0])
