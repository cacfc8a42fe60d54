"""Dipoles of a half-space: the classical one, and the better dipole with sources all along the beam."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.diffusion.boundary import internal_moment
from dermis.optics.media import Floats, Layer


def depths(layer: Layer, A: float) -> tuple[Floats, Floats]:
    """Depth of the real source, and height of its image above the surface, both (c,) and positive [mm].

    A : boundary mismatch, of `boundary.mismatch` [-]

    Source: [Jensen2001] section 2.3.
    """
    z_r = layer.mean_free_path_mm
    return z_r, z_r + 4.0 * A * layer.D


def flux(radius_mm: ArrayLike, depth_mm: Floats, sigma_tr: Floats) -> Floats:
    """Flux through the surface from a unit source at a signed depth in an infinite medium, (n, c) [1/mm2].

    radius_mm : (n,) distances along the surface [mm]

    Source: [Jensen2001] eq. 4 without the misprinted factor: see [JensenBuhler2002] eq. 5.
    """
    rho = np.sqrt(np.asarray(radius_mm, dtype=np.float64)[..., None] ** 2 + depth_mm**2)
    fall = np.exp(-sigma_tr * rho)
    return np.asarray(depth_mm * (1.0 + sigma_tr * rho) * fall / (4.0 * np.pi * rho**3))


def reflectance(radius_mm: ArrayLike, layer: Layer, A: float) -> Floats:
    """R(r) per power that entered, (n, c) [1/mm2].

    Source: [JensenBuhler2002] eq. 5.
    """
    z_r, z_v = depths(layer, A)
    both = flux(radius_mm, z_r, layer.sigma_tr) + flux(radius_mm, z_v, layer.sigma_tr)
    return np.asarray(layer.alpha_prime * both)


def reflectance_hankel(frequency: ArrayLike, layer: Layer, A: float) -> Floats:
    """Hankel transform of R(r), integral of 2 pi r R(r) J0(s r), by frequency s [1/mm], (n, c) [-]."""
    z_r, z_v = depths(layer, A)
    q = np.sqrt(layer.sigma_tr**2 + np.asarray(frequency, dtype=np.float64)[..., None] ** 2)
    return np.asarray(0.5 * layer.alpha_prime * (np.exp(-z_r * q) + np.exp(-z_v * q)))


def total(layer: Layer, A: float) -> Floats:
    """Share of the light that entered and leaves again, (c,) [-]."""
    return np.asarray(reflectance_hankel(0.0, layer, A))


def better_reflectance(radius_mm: ArrayLike, layer: Layer, eta: float, depths: int = 100) -> Floats:
    """R(r) of a half-space per power that entered, light scattered at least twice, (n, c) [1/mm2].

    radius_mm : (n,) distances [mm]
    eta : index of refraction [-]
    depths : sources along the beam [-]

    Source: [dEonIrving2011] with the corrections of [Habel2013], as the dipole term of [Pharr2023].
    """
    r = np.asarray(radius_mm, dtype=np.float64)
    F1, F2 = internal_moment(1, eta), internal_moment(2, eta)
    D_g = (2.0 * layer.sigma_a + layer.sigma_s_prime) / (3.0 * layer.sigma_t_prime**2)
    sigma_tr = np.sqrt(layer.sigma_a / D_g)
    z_e = 2.0 * D_g * (1.0 + 3.0 * F2) / (1.0 - 2.0 * F1)
    result = np.zeros((*r.shape, len(layer.sigma_a)))
    for u in (np.arange(depths) + 0.5) / depths:  # equal shares of the beam's first events
        z_r = -np.log1p(-u) / layer.sigma_t_prime
        z_v = z_r + 2.0 * z_e
        d_r, d_v = (np.sqrt(r[..., None] ** 2 + z**2) for z in (z_r, z_v))
        fluence = (np.exp(-sigma_tr * d_r) / d_r - np.exp(-sigma_tr * d_v) / d_v) / (4.0 * np.pi * D_g)
        outward = flux(r, z_r, sigma_tr) + flux(r, z_v, sigma_tr)
        # Diffusion overestimates near light that scattered once: an empirical fade.
        kappa = -np.expm1(-2.0 * layer.sigma_t_prime * (d_r + z_r))
        result += kappa * (fluence * (1.0 - 2.0 * F1) / 4.0 + outward * (1.0 - 3.0 * F2) / 2.0)
    return np.asarray(layer.alpha_prime**2 * result / depths)
