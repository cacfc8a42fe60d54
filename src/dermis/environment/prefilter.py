"""A panorama as the frame reads it: irradiance by normal, and reflections in ever rougher mirrors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.base.progress import logged_step
from dermis.environment.harmonics import analyse, synthesise, zonal
from dermis.environment.panorama import Sun, load_panorama, split_suns
from dermis.specular.beckmann import beckmann

Floats = NDArray[np.float64]
SMOOTHEST, ROUGHEST = 0.018, 1.0
ROUGHNESSES = np.geomspace(SMOOTHEST, ROUGHEST, 13)
"""Of the reflections' layers, even in the logarithm, between which the shader interpolates."""
HEIGHT = 192
_DEGREE = 160  # the smoothest lobe multiplies this degree by 2e-4: hardly any ringing around lamps


def isotropic_lobe(theta: Floats, m: float) -> Floats:
    """Weight of light at an angle from the mirror direction, seen along the normal [1/sr, up to a factor].

    theta : [rad], 0 to pi / 2
    m : roughness [-]

    The Kelemen lobe with n = v = r [Karis2013]: the half vector is at theta / 2, and h.h is
    4 cos^2(theta / 2).
    """
    half = np.cos(0.5 * theta)
    with np.errstate(under="ignore"):
        return np.asarray(beckmann(half, m) * np.cos(theta) / half**2)


def reflection_constants() -> dict[str, float]:
    """Numbers that environment.wgsl fills in."""
    return {
        "reflections": len(ROUGHNESSES),
        "smoothest_reflection": SMOOTHEST,
        "roughest_reflection": ROUGHEST,
    }


@dataclass(frozen=True)
class Prefiltered:
    """A panorama, prefiltered.

    layers : (14, h, 2 h, 3) float32: irradiance by normal, then mean radiance by mirror direction
    suns : its peaks, which the layers leave out
    """

    layers: NDArray[np.float32]
    suns: tuple[Sun, ...]


@logged_step("filtering the environment")
def prefilter(name: str) -> Prefiltered:
    """A panorama's layers and suns. It takes a quarter of a second, so nothing is kept on disk.

    name : as for `load_panorama`

    Each layer is the panorama convolved with a round kernel, exactly, in spherical harmonics of degree 160:
    no samples are drawn, so lamps leave no fireflies.

    Sources: [KautzMcCool2000] for reflections by roughness, [RamamoorthiHanrahan2001] for irradiance.
    """
    radiance, suns = split_suns(load_panorama(name))
    coefficients = analyse(radiance, _DEGREE)
    kernels = [zonal(np.cos, _DEGREE), *(isotropic_kernel(float(m)) for m in ROUGHNESSES)]
    layers = [synthesise(coefficients, factors, HEIGHT) for factors in kernels]
    return Prefiltered(np.maximum(layers, 0.0).astype(np.float32), tuple(suns))


def isotropic_kernel(m: float) -> Floats:
    """(161,) factors of the round lobe of roughness m, with the sum 1 over the sphere."""
    factors = zonal(lambda theta: isotropic_lobe(theta, m), _DEGREE)
    return np.asarray(factors / factors[0])
