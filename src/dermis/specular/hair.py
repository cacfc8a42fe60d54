"""Scattering of a hair fibre: a rough, absorbing dielectric cylinder in the far field."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

ETA = 1.55
"""Index of refraction of keratin [Marschner2003]."""
TILT = np.radians(2.0)
"""Tilt of the scales of the cuticle towards the tip [rad]."""
LONGITUDINAL_ROUGHNESS, AZIMUTHAL_ROUGHNESS = 0.22, 0.5
"""Perceptual roughness along and around the fibre, 0 to 1 [Chiang2016]."""
FIBRE_SAMPLES = 16
"""Number of rays across the fibre, also in hair.wgsl."""
_MIN_COS_SQUARED = 1e-5
_EUMELANIN, _PHEOMELANIN = np.array([0.419, 0.697, 1.37]), np.array([0.187, 0.4, 1.05])
_REFERENCE_RADIUS_MM = 0.04  # radius of the hairs to which these absorptions per radius apply


class FibreParameters(NamedTuple):
    """Widths of a fibre's scattering lobes.

    variance : longitudinal, of the lobes R, TT, TRT and all further ones
    width : of the azimuthal logistic distribution [rad]
    """

    variance: tuple[float, float, float, float]
    width: float


def fibre(along: float = LONGITUDINAL_ROUGHNESS, around: float = AZIMUTHAL_ROUGHNESS) -> FibreParameters:
    """Return the lobe widths of a fibre by its longitudinal and azimuthal roughness.

    Source: [Chiang2016] equations 7 and 8.
    """
    v = (0.726 * along + 0.812 * along**2 + 3.7 * along**20) ** 2
    width = np.sqrt(np.pi / 8) * (0.265 * around + 1.194 * around**2 + 5.372 * around**22)
    return FibreParameters((v, 0.25 * v, 4.0 * v, 4.0 * v), float(width))


def hair_constants() -> dict[str, float]:
    """Return the constants that are filled into hair.wgsl."""
    default = fibre()
    return {
        "hair_eta": ETA,
        "hair_width": default.width,
        "hair_logistic_norm": float(1.0 / np.tanh(np.pi / (2 * default.width))),
        "hair_variance": default.variance[0],
        "hair_tilt": float(TILT),
        "hair_samples": FIBRE_SAMPLES,
    }


def absorption_per_mm(eumelanin: ArrayLike, pheomelanin: ArrayLike) -> Floats:
    """Return the absorption (..., 3) of the inside of hairs from concentrations of pigments [1/mm].

    Eumelanin of 0.3 is blond, 1.3 brown, 8 black; pheomelanin of 2 alone is red. Source: [dEon2011] section
    6.1.
    """
    brown, red = (np.asarray(c, float)[..., None] for c in (eumelanin, pheomelanin))
    return np.asarray((brown * _EUMELANIN + red * _PHEOMELANIN) / _REFERENCE_RADIUS_MM)


def longitudinal(sin_i: ArrayLike, sin_o: ArrayLike, v: float) -> Floats:
    """Return the longitudinal scattering function, which integrates to 1 over the light's cosines.

    sin_i, sin_o : sines of light and view along the fibre
    v : variance

    Source: [dEon2011] equation 7.
    """
    i, o = np.asarray(sin_i, float), np.asarray(sin_o, float)
    a = np.sqrt(np.maximum(1 - i * i, 0.0) * np.maximum(1 - o * o, 0.0)) / v
    # exp(-i o / v) I0(a) / (2 v sinh(1 / v)), without overflow
    return np.asarray(np.i0(a) * np.exp(-a) * np.exp(a - i * o / v - 1 / v) / (v * -np.expm1(-2 / v)))


def logistic(x: ArrayLike, width: float) -> Floats:
    """Return the logistic distribution over angles, truncated to (-pi, pi) [1/rad]. Source: [Chiang2016]."""
    wrapped = np.abs(np.mod(np.asarray(x, float) + np.pi, 2 * np.pi) - np.pi)
    e = np.exp(-wrapped / width)
    return np.asarray(e / (width * (1 + e) ** 2) / np.tanh(np.pi / (2 * width)))


def fresnel(cosine: ArrayLike) -> Floats:
    """Return the Fresnel reflectance of the cuticle for a cosine of incidence [-]."""
    c = np.clip(np.asarray(cosine, float), 0.0, 1.0)
    t = np.sqrt(1 - (1 - c * c) / ETA**2)
    parallel, across = (ETA * c - t) / (ETA * c + t), (c - ETA * t) / (c + ETA * t)
    return np.asarray(0.5 * (parallel**2 + across**2))


def attenuations(sin_o: ArrayLike, depth: ArrayLike, h: ArrayLike) -> list[Floats]:
    """Return the fractions (..., 3) of light in the lobes R, TT, TRT and all further ones.

    sin_o : sine of the view along the fibre
    depth : (..., 3) absorption over a radius
    h : offset of the incident ray across the fibre, -1 to 1

    Without absorption they sum to 1. Source: [Chiang2016] section 4.
    """
    o, h = np.asarray(sin_o, float), np.asarray(h, float)
    cos_o = np.sqrt(np.maximum(1 - o * o, _MIN_COS_SQUARED))
    sin_inner = h * cos_o / np.sqrt(ETA**2 - o * o)
    path_length = 2 * np.sqrt(1 - sin_inner**2) / np.sqrt(1 - (o / ETA) ** 2)
    attenuation = np.exp(-np.asarray(depth, float) * path_length[..., None])
    f = fresnel(cos_o * np.sqrt(1 - h * h))[..., None]
    transmitted = (1 - f) ** 2 * attenuation
    internal = transmitted * attenuation * f
    residual = internal * f * attenuation / (1 - f * attenuation)
    return [np.broadcast_to(f, attenuation.shape), transmitted, internal, residual]


def scattering(
    sin_i: ArrayLike, sin_o: ArrayLike, phi: ArrayLike, depth: ArrayLike, parameters: FibreParameters
) -> Floats:
    """Return the radiance (..., 3) per irradiance, averaged over the fibre's width [1/sr].

    sin_i, sin_o : sines of light and view along the fibre, towards its tip
    phi : azimuth between them [rad]
    depth : (3,) absorption over a radius

    The irradiance is that of a plane that faces the light. The cosine of incidence on the fibre is included:
    without absorption the integral over all light directions is 1. Source: [Marschner2003], with the terms of
    [dEon2011, Chiang2016].
    """
    i, o, phi = np.broadcast_arrays(*(np.asarray(x, float) for x in (sin_i, sin_o, phi)))
    cos_o = np.sqrt(np.maximum(1 - o * o, _MIN_COS_SQUARED))
    total = np.zeros((*o.shape, 3))
    for h in (np.arange(FIBRE_SAMPLES) + 0.5) * 2 / FIBRE_SAMPLES - 1:
        entry, inner = np.arcsin(h), np.arcsin(h * cos_o / np.sqrt(ETA**2 - o * o))
        for p, term in enumerate(attenuations(o, depth, np.full(o.shape, h))):
            exit_azimuth = 2 * p * inner - 2 * entry + p * np.pi
            around = np.full(o.shape, 0.5 / np.pi)
            if p < 3:
                around = logistic(phi - exit_azimuth, parameters.width)
            along = longitudinal(i, tilted_sine(o, p), parameters.variance[p])
            total += term * (along * around / FIBRE_SAMPLES)[..., None]
    return total


def tilted_sine(sin_o: ArrayLike, p: int) -> Floats:
    """Return the sine of the view corrected for the tilt of the cuticle's scales, for lobe p."""
    angle = np.arcsin(np.clip(np.asarray(sin_o, float), -1, 1))
    return np.asarray(np.sin(angle + (-2.0, 1.0, 4.0, 0.0)[p] * TILT))
