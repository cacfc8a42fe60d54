"""Prefiltering of a panorama to irradiance for each normal, and reflected radiance for each roughness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.base.progress import logged_step
from dermis.environment.harmonics import analyse_panorama, synthesise_panoramas, zonal_factors
from dermis.environment.panorama import Sun, load_panorama, split_suns
from dermis.specular.beckmann import beckmann

Floats = NDArray[np.float64]
MIN_LAYER_ROUGHNESS, MAX_LAYER_ROUGHNESS = 0.018, 1.0
LAYER_ROUGHNESSES = np.geomspace(MIN_LAYER_ROUGHNESS, MAX_LAYER_ROUGHNESS, 13)
"""Roughnesses for which reflected radiance is stored, evenly spaced in their logarithm.

The shader interpolates between them.
"""
LAYER_HEIGHT = 192
_MAX_HARMONIC_DEGREE = 160  # the factor of the smoothest lobe is 2e-4 here, so there is little ringing


def isotropic_lobe(theta: Floats, roughness: float) -> Floats:
    """Return the weight of light at an angle to the mirror direction, for a view along the normal.

    theta : angle from the mirror direction [rad], 0 to pi / 2
    roughness : roughness m of the Beckmann distribution [-]

    The weight is the Kelemen lobe times cos(theta), up to a constant factor. Normal, view and mirror
    direction are assumed to be equal [Karis2013], so the half vector is at the angle theta / 2 from the
    normal.
    """
    half = np.cos(0.5 * theta)
    with np.errstate(under="ignore"):
        return np.asarray(beckmann(half, roughness) * np.cos(theta) / half**2)


def reflection_constants() -> dict[str, float]:
    """Return named values that `//#fill` lines insert into environment.wgsl.

    The values are the number and the roughness range of the layers of reflected radiance.
    """
    return {
        "reflections": len(LAYER_ROUGHNESSES),
        "smoothest_reflection": MIN_LAYER_ROUGHNESS,
        "roughest_reflection": MAX_LAYER_ROUGHNESS,
    }


@dataclass(frozen=True)
class PrefilteredPanorama:
    """Panorama convolved with a cosine and with lobes of several roughnesses, for lookups by the shader.

    layers : (14, h, 2 h, 3) panoramas: first the irradiance by normal direction, then, for each of
        `LAYER_ROUGHNESSES`, the weighted mean radiance by mirror direction
    suns : directional lights that replace the small, very bright areas of the panorama, such as the sun;
        these areas were removed before the convolution
    """

    layers: NDArray[np.float32]
    suns: tuple[Sun, ...]


@logged_step("filtering the environment")
def prefilter(panorama_name: str) -> PrefilteredPanorama:
    """Load a panorama, separate its brightest areas, and convolve the remainder with isotropic kernels.

    The brightest areas, such as the sun, become directional lights in the field `suns` of the result.

    panorama_name : see `load_panorama`

    The convolution multiplies the coefficients of spherical harmonics up to degree 160, so there is no noise
    from sampling.

    Sources: [KautzMcCool2000] for reflections by roughness, [RamamoorthiHanrahan2001] for irradiance.
    """
    radiance, suns = split_suns(load_panorama(panorama_name))
    coefficients = analyse_panorama(radiance, _MAX_HARMONIC_DEGREE)
    kernels = [
        zonal_factors(np.cos, _MAX_HARMONIC_DEGREE),
        *(isotropic_lobe_factors(float(m)) for m in LAYER_ROUGHNESSES),
    ]
    layers = synthesise_panoramas(coefficients, np.stack(kernels), LAYER_HEIGHT)
    return PrefilteredPanorama(np.maximum(layers, 0.0).astype(np.float32), tuple(suns))


def isotropic_lobe_factors(roughness: float) -> Floats:
    """Return the factors by which convolution with an isotropic lobe multiplies harmonic coefficients.

    There is one factor for each degree of the spherical harmonics, (161,). The lobe has unit integral.

    roughness : roughness m of the lobe [-]
    """
    factors = zonal_factors(lambda theta: isotropic_lobe(theta, roughness), _MAX_HARMONIC_DEGREE)
    return np.asarray(factors / factors[0])
