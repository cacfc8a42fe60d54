"""How much the surface reflects in all directions: the share that does not enter the skin."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.specular.fresnel import SKIN_F0, schlick

Floats = NDArray[np.float64]
TABLE_COSINES = 64
TABLE_ROUGHNESSES = 32


def directional_albedo(
    cos_theta: ArrayLike, m: ArrayLike, f0: float = SKIN_F0, nodes: tuple[int, int] = (48, 48)
) -> Floats:
    """Hemispherical reflectance rho_dt of the Kelemen lobe for rho_s = 1 [-].

    cos_theta : cosine of the incident or, the same by reciprocity, the exitant angle
    m : roughness; broadcast against cos_theta
    nodes : points of the quadrature over the half vector's slope and azimuth

    The integral runs over half vectors instead of directions: with x = tan^2 / m^2 the Beckmann peak becomes
    exp(-x), which midpoints in exp(-x) sample evenly at any roughness, where the 80 x 80 directions of the
    published rule miss it. Divided by pi as the lobe is.

    Source: [dEonLuebke2007] section 14.3 for the quantity.
    """
    cosine, rough = np.broadcast_arrays(np.asarray(cos_theta, float), np.asarray(m, float))
    c, m2 = cosine[..., None, None], rough[..., None, None] ** 2
    x = -np.log((np.arange(nodes[0]) + 0.5) / nodes[0])[:, None]
    phi = np.pi * (np.arange(nodes[1]) + 0.5)[None, :] / nodes[1]
    cos_h = 1.0 / np.sqrt(1.0 + m2 * x)
    sin_h = np.sqrt(1.0 - cos_h**2)
    v_h = c * cos_h + np.sqrt(np.maximum(1.0 - c**2, 0.0)) * sin_h * np.cos(phi)
    n_l = 2.0 * v_h * cos_h - c
    lit = (n_l > 0) & (v_h > 1e-9)
    ratio = np.where(lit, n_l / np.where(lit, v_h, 1.0), 0.0)
    integrand = schlick(v_h, f0) * ratio / cos_h
    albedo: Floats = integrand.mean(axis=(-2, -1))
    return albedo


@cache
def albedo_table() -> NDArray[np.float32]:
    """(roughness, cosine) table of `directional_albedo` for the shader, at texel centres in 0..1."""
    cosine = (np.arange(TABLE_COSINES) + 0.5) / TABLE_COSINES
    m = (np.arange(TABLE_ROUGHNESSES) + 0.5) / TABLE_ROUGHNESSES
    return directional_albedo(cosine[None, :], m[:, None]).astype(np.float32)
