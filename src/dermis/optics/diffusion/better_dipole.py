"""The better dipole: sources all along the beam, Grosjean's diffusion, and exit by fluence and flux."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.diffusion.boundary import internal_moment
from dermis.optics.diffusion.dipole import flux
from dermis.optics.media import Floats, Layer


def reflectance(radius_mm: ArrayLike, layer: Layer, eta: float, depths: int = 100) -> Floats:
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
        # Diffusion overrates light that scattered once and is near: an empirical fade.
        kappa = -np.expm1(-2.0 * layer.sigma_t_prime * (d_r + z_r))
        result += kappa * (fluence * (1.0 - 2.0 * F1) / 4.0 + outward * (1.0 - 3.0 * F2) / 2.0)
    return np.asarray(layer.alpha_prime**2 * result / depths)
