"""Light scattering by a hair fibre: a rough, absorbing dielectric cylinder, seen from afar."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

KERATIN_ETA = 1.55
"""Index of refraction of keratin [Marschner2003]."""
CUTICLE_TILT = np.radians(2.0)
"""Angle by which the scales of the cuticle are tilted against the axis of the fibre [rad]."""
LONGITUDINAL_ROUGHNESS, AZIMUTHAL_ROUGHNESS = 0.22, 0.5
"""Default perceptual roughness along and around the fibre, 0 to 1 [Chiang2016]."""
FIBRE_SAMPLE_COUNT = 16
"""Number of rays across the width of the fibre over which scattering is averaged."""
_MIN_COS_SQUARED = 1e-5
_EUMELANIN_ABSORPTION, _PHEOMELANIN_ABSORPTION = np.array([0.419, 0.697, 1.37]), np.array([0.187, 0.4, 1.05])
_REFERENCE_FIBRE_RADIUS_MM = 0.04  # radius of a hair; the absorptions above are per radius


class FibreParameters(NamedTuple):
    """Widths of the scattering lobes of a hair fibre.

    variance : longitudinal variances of four lobes: R (reflected light), TT (transmitted light), TRT (light
        reflected once inside the fibre), and all light with more internal reflections
    width : scale of the azimuthal logistic distribution [rad]
    """

    variance: tuple[float, float, float, float]
    width: float


def fibre_parameters(
    longitudinal_roughness: float = LONGITUDINAL_ROUGHNESS, azimuthal_roughness: float = AZIMUTHAL_ROUGHNESS
) -> FibreParameters:
    """Return the lobe widths of a fibre from its perceptual roughness along and around its axis.

    longitudinal_roughness : roughness along the axis, 0 to 1 [-]
    azimuthal_roughness : roughness around the axis, 0 to 1 [-]

    Source: [Chiang2016] equations 7 and 8.
    """
    v = (
        0.726 * longitudinal_roughness + 0.812 * longitudinal_roughness**2 + 3.7 * longitudinal_roughness**20
    ) ** 2
    width = np.sqrt(np.pi / 8) * (
        0.265 * azimuthal_roughness + 1.194 * azimuthal_roughness**2 + 5.372 * azimuthal_roughness**22
    )
    return FibreParameters((v, 0.25 * v, 4.0 * v, 4.0 * v), float(width))


def hair_constants() -> dict[str, float]:
    """Return a dictionary from the names of the placeholders in hair.wgsl to their values."""
    default = fibre_parameters()
    return {
        "hair_eta": KERATIN_ETA,
        "hair_width": default.width,
        "hair_logistic_norm": float(1.0 / np.tanh(np.pi / (2 * default.width))),
        "hair_variance": default.variance[0],
        "hair_tilt": float(CUTICLE_TILT),
        "hair_samples": FIBRE_SAMPLE_COUNT,
    }


def absorption_per_mm(eumelanin: ArrayLike, pheomelanin: ArrayLike) -> Floats:
    """Return the absorption coefficient (..., 3) inside hairs from their pigment concentrations [1/mm].

    eumelanin : concentration of brown pigment: 0.3 is blond, 1.3 brown, 8 black
    pheomelanin : concentration of red pigment: 2 without eumelanin gives red hair

    Source: [dEon2011] section 6.1.
    """
    brown, red = (np.asarray(c, float)[..., None] for c in (eumelanin, pheomelanin))
    return np.asarray(
        (brown * _EUMELANIN_ABSORPTION + red * _PHEOMELANIN_ABSORPTION) / _REFERENCE_FIBRE_RADIUS_MM
    )


def dense_hair_reflectance(absorption: ArrayLike, radius_mm: float = _REFERENCE_FIBRE_RADIUS_MM) -> Floats:
    """Return the diffuse reflectance (3,) of an infinitely dense layer of hair [-].

    The layer is a medium that scatters isotropically with the albedo of a hair that is seen from the side.

    absorption : (3,) absorption coefficient of the hairs [1/mm]
    radius_mm : radius of the hairs [mm]

    Source: [dEon2011] for the albedo of a hair.
    """
    offsets = (np.arange(FIBRE_SAMPLE_COUNT) + 0.5) * 2 / FIBRE_SAMPLE_COUNT - 1
    depth = np.asarray(absorption, float) * radius_mm
    albedo = np.mean([np.sum(lobe_fractions(0.0, depth, h), axis=0) for h in offsets], axis=0)
    root = np.sqrt(np.maximum(1.0 - albedo, 0.0))
    return np.asarray((1.0 - root) / (1.0 + root))


def longitudinal_scattering(sin_i: ArrayLike, sin_o: ArrayLike, variance: float) -> Floats:
    """Return the longitudinal scattering function, whose integral over sin_i is 1 [-].

    sin_i : sine of the angle by which the direction to the light is inclined towards the tip of the fibre
    sin_o : sine of the same angle for the direction to the viewer
    variance : variance of the lobe

    Source: [dEon2011] equation 7.
    """
    i, o = np.asarray(sin_i, float), np.asarray(sin_o, float)
    a = np.sqrt(np.maximum(1 - i * i, 0.0) * np.maximum(1 - o * o, 0.0)) / variance
    # exp(-i o / v) I0(a) / (2 v sinh(1 / v)), without overflow
    return np.asarray(
        np.i0(a)
        * np.exp(-a)
        * np.exp(a - i * o / variance - 1 / variance)
        / (variance * -np.expm1(-2 / variance))
    )


def azimuthal_logistic(azimuth: ArrayLike, width: float) -> Floats:
    """Return the density of the logistic distribution truncated to (-pi, pi) at an azimuth [1/rad].

    azimuth : azimuth around the fibre [rad]
    width : scale of the distribution [rad]

    Source: [Chiang2016].
    """
    wrapped = np.abs(np.mod(np.asarray(azimuth, float) + np.pi, 2 * np.pi) - np.pi)
    e = np.exp(-wrapped / width)
    return np.asarray(e / (width * (1 + e) ** 2) / np.tanh(np.pi / (2 * width)))


def keratin_reflectance(cos_incidence: ArrayLike) -> Floats:
    """Return the Fresnel reflectance of keratin for the cosine of the angle of incidence [-]."""
    c = np.clip(np.asarray(cos_incidence, float), 0.0, 1.0)
    t = np.sqrt(1 - (1 - c * c) / KERATIN_ETA**2)
    parallel, across = (
        (KERATIN_ETA * c - t) / (KERATIN_ETA * c + t),
        (c - KERATIN_ETA * t) / (c + KERATIN_ETA * t),
    )
    return np.asarray(0.5 * (parallel**2 + across**2))


def lobe_fractions(sin_o: ArrayLike, absorption_depth: ArrayLike, ray_offset: ArrayLike) -> list[Floats]:
    """Return four arrays (..., 3): fractions of light in the lobes R, TT and TRT and in all further lobes.

    R is reflected light, TT is transmitted light, and TRT is light reflected once inside the fibre. Without
    absorption, the four fractions sum to 1.

    sin_o : sine of the angle by which the direction to the viewer is inclined towards the tip of the fibre
    absorption_depth : (..., 3) absorption coefficient times the radius of the fibre [-]
    ray_offset : offset of the incident ray from the fibre's axis, in units of the fibre's radius, -1 to 1 [-]

    Source: [Chiang2016] section 4.
    """
    o, ray_offset = np.asarray(sin_o, float), np.asarray(ray_offset, float)
    cos_o = np.sqrt(np.maximum(1 - o * o, _MIN_COS_SQUARED))
    sin_inner = ray_offset * cos_o / np.sqrt(KERATIN_ETA**2 - o * o)
    path_length = 2 * np.sqrt(1 - sin_inner**2) / np.sqrt(1 - (o / KERATIN_ETA) ** 2)
    attenuation = np.exp(-np.asarray(absorption_depth, float) * path_length[..., None])
    f = keratin_reflectance(cos_o * np.sqrt(1 - ray_offset * ray_offset))[..., None]
    transmitted = (1 - f) ** 2 * attenuation
    internal = transmitted * attenuation * f
    residual = internal * f * attenuation / (1 - f * attenuation)
    return [np.broadcast_to(f, attenuation.shape), transmitted, internal, residual]


def fibre_scattering(
    sin_i: ArrayLike,
    sin_o: ArrayLike,
    phi: ArrayLike,
    absorption_depth: ArrayLike,
    parameters: FibreParameters,
) -> Floats:
    """Return the radiance (..., 3) of a fibre per unit of irradiance, averaged over the fibre's width [1/sr].

    sin_i : sine of the angle by which the direction to the light is inclined towards the tip of the fibre
    sin_o : sine of the same angle for the direction to the viewer
    phi : azimuth around the fibre from light to viewer [rad]
    absorption_depth : (3,) absorption coefficient times the radius of the fibre [-]
    parameters : widths of the lobes

    Irradiance is measured on a plane that faces the light. The result includes the cosine of incidence on the
    fibre, so its integral over all light directions is 1 without absorption.

    Source: [Marschner2003], with the terms of [dEon2011, Chiang2016].
    """
    i, o, phi = np.broadcast_arrays(*(np.asarray(x, float) for x in (sin_i, sin_o, phi)))
    cos_o = np.sqrt(np.maximum(1 - o * o, _MIN_COS_SQUARED))
    total = np.zeros((*o.shape, 3))
    for h in (np.arange(FIBRE_SAMPLE_COUNT) + 0.5) * 2 / FIBRE_SAMPLE_COUNT - 1:
        entry, inner = np.arcsin(h), np.arcsin(h * cos_o / np.sqrt(KERATIN_ETA**2 - o * o))
        for p, term in enumerate(lobe_fractions(o, absorption_depth, np.full(o.shape, h))):
            exit_azimuth = 2 * p * inner - 2 * entry + p * np.pi
            around = np.full(o.shape, 0.5 / np.pi)
            if p < 3:
                around = azimuthal_logistic(phi - exit_azimuth, parameters.width)
            along = longitudinal_scattering(i, tilted_sine(o, p), parameters.variance[p])
            total += term * (along * around / FIBRE_SAMPLE_COUNT)[..., None]
    return total


def tilted_sine(sin_o: ArrayLike, crossing_count: int) -> Floats:
    """Return the sine of the viewer's inclination for one lobe, corrected for the tilt of the cuticle scales.

    sin_o : sine of the angle by which the direction to the viewer is inclined towards the tip of the fibre
    crossing_count : number of times that light crosses the fibre: 0 for the lobe R, 1 for TT, 2 for TRT; 3
        stands for all further lobes
    """
    angle = np.arcsin(np.clip(np.asarray(sin_o, float), -1, 1))
    return np.asarray(np.sin(angle + (-2.0, 1.0, 4.0, 0.0)[crossing_count] * CUTICLE_TILT))
