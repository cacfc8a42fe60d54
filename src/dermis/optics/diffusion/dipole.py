"""The classical dipole: light that left a half-space, from one source below it and one image above."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

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
