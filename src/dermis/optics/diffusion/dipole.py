"""Dipole models of a half-space: the standard dipole, and the better dipole with sources along the beam."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.diffusion.boundary import internal_moment
from dermis.optics.media import Floats, Layer


def source_depths(layer: Layer, boundary_mismatch: float) -> tuple[Floats, Floats]:
    """Return the depth (c,) of the point source, and the height (c,) of its image above the surface [mm].

    layer : absorption and scattering of the half-space
    boundary_mismatch : boundary mismatch A of the surface, see `boundary_mismatch` [-]

    Source: [Jensen2001] section 2.3.
    """
    z_r = layer.mean_free_path_mm
    return z_r, z_r + 4.0 * boundary_mismatch * layer.D


def point_source_flux(radius_mm: ArrayLike, depth_mm: Floats, sigma_tr: Floats) -> Floats:
    """Return the flux (n, c) through the surface from a unit point source in an infinite medium [1/mm2].

    radius_mm : (n,) distances along the surface [mm]
    depth_mm : (c,) depth of the source; negative for a source above the surface [mm]
    sigma_tr : (c,) effective transport coefficient [1/mm]

    Source: [Jensen2001] eq. 4, with its misprinted factor left out as in [JensenBuhler2002] eq. 5.
    """
    rho = np.sqrt(np.asarray(radius_mm, dtype=np.float64)[..., None] ** 2 + depth_mm**2)
    attenuation = np.exp(-sigma_tr * rho)
    return np.asarray(depth_mm * (1.0 + sigma_tr * rho) * attenuation / (4.0 * np.pi * rho**3))


def reflectance(radius_mm: ArrayLike, layer: Layer, boundary_mismatch: float) -> Floats:
    """Return the diffusion profile R(r), (n, c), of the standard dipole [1/mm2].

    R(r) is relative to the power that enters the medium.

    radius_mm : (n,) distances r from the beam [mm]
    layer : absorption and scattering of the half-space
    boundary_mismatch : boundary mismatch A of the surface, see `boundary_mismatch` [-]

    Source: [JensenBuhler2002] eq. 5.
    """
    z_r, z_v = source_depths(layer, boundary_mismatch)
    fluxes = point_source_flux(radius_mm, z_r, layer.sigma_tr) + point_source_flux(
        radius_mm, z_v, layer.sigma_tr
    )
    return np.asarray(layer.alpha_prime * fluxes)


def reflectance_hankel(frequency: ArrayLike, layer: Layer, boundary_mismatch: float) -> Floats:
    """Return the Hankel transform (n, c) of the standard dipole's R(r) [-].

    The transform is the integral of 2 pi r R(r) J0(s r) over r, with the Bessel function J0.

    frequency : (n,) frequencies s [1/mm]
    layer : absorption and scattering of the half-space
    boundary_mismatch : boundary mismatch A of the surface, see `boundary_mismatch` [-]
    """
    z_r, z_v = source_depths(layer, boundary_mismatch)
    q = np.sqrt(layer.sigma_tr**2 + np.asarray(frequency, dtype=np.float64)[..., None] ** 2)
    return np.asarray(0.5 * layer.alpha_prime * (np.exp(-z_r * q) + np.exp(-z_v * q)))


def total_reflectance(layer: Layer, boundary_mismatch: float) -> Floats:
    """Return the total reflectance (c,) of the dipole model, relative to the power that enters [-].

    layer : absorption and scattering of the half-space
    boundary_mismatch : boundary mismatch A of the surface, see `boundary_mismatch` [-]
    """
    return np.asarray(reflectance_hankel(0.0, layer, boundary_mismatch))


def better_dipole_reflectance(
    radius_mm: ArrayLike, layer: Layer, eta: float, source_count: int = 100
) -> Floats:
    """Return R(r), (n, c), of the better dipole for light that scattered at least twice [1/mm2].

    R(r) is relative to the power that enters the medium.

    radius_mm : (n,) distances r from the beam [mm]
    layer : absorption and scattering of the half-space
    eta : index of refraction relative to air [-]
    source_count : number of point sources along the beam

    Source: [dEonIrving2011] with the corrections of [Habel2013]; the same as the dipole term in [Pharr2023].
    """
    r = np.asarray(radius_mm, dtype=np.float64)
    F1, F2 = internal_moment(1, eta), internal_moment(2, eta)
    D_g = (2.0 * layer.sigma_a + layer.sigma_s_prime) / (3.0 * layer.sigma_t_prime**2)
    sigma_tr = np.sqrt(layer.sigma_a / D_g)
    z_e = 2.0 * D_g * (1.0 + 3.0 * F2) / (1.0 - 2.0 * F1)
    result = np.zeros((*r.shape, len(layer.sigma_a)))
    for u in (np.arange(source_count) + 0.5) / source_count:  # equal fractions of the first scattering events
        z_r = -np.log1p(-u) / layer.sigma_t_prime
        z_v = z_r + 2.0 * z_e
        d_r, d_v = (np.sqrt(r[..., None] ** 2 + z**2) for z in (z_r, z_v))
        fluence = (np.exp(-sigma_tr * d_r) / d_r - np.exp(-sigma_tr * d_v) / d_v) / (4.0 * np.pi * D_g)
        outward = point_source_flux(r, z_r, sigma_tr) + point_source_flux(r, z_v, sigma_tr)
        # Empirical correction: diffusion overestimates light that scattered once close to the beam.
        kappa = -np.expm1(-2.0 * layer.sigma_t_prime * (d_r + z_r))
        result += kappa * (fluence * (1.0 - 2.0 * F1) / 4.0 + outward * (1.0 - 3.0 * F2) / 2.0)
    return np.asarray(layer.alpha_prime**2 * result / source_count)
