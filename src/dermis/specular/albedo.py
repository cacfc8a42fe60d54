"""Directional albedo of specular lobes: the fraction of the incident light that a lobe reflects."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.specular.cosines import Cosines
from dermis.specular.fresnel import FRESNEL, Fresnel, schlick
from dermis.specular.kelemen import kelemen
from dermis.specular.models import MODELS, Lobe

Floats = NDArray[np.float64]
MIN_ROUGHNESS_ROOT = 0.2
TABLE_COSINES: Floats = np.linspace(0.0, 1.0, 64) ** 2
TABLE_ROUGHNESSES: Floats = np.linspace(MIN_ROUGHNESS_ROOT, 1.0, 32) ** 2
"""Roughnesses of `albedo_table`, spaced evenly in the square root.

TABLE_COSINES has the same spacing, to resolve grazing angles.
"""

_TABLE_NODE_COUNTS = (24, 12)
_MIN_COSINE = 1e-3


def directional_albedo(
    cos_theta: ArrayLike,
    m: ArrayLike,
    lobe: Lobe = kelemen,
    fresnel: Fresnel = schlick,
    node_counts: tuple[int, int] = (48, 32),
) -> Floats:
    """Return the directional-hemispherical reflectance rho_dt of a lobe of specular strength rho_s = 1 [-].

    cos_theta : cosine of the angle between the normal and the direction to the viewer; for reciprocal lobes,
        the result is the same for the direction to the light
    m : roughness; broadcast against cos_theta [-]
    lobe : BRDF to integrate
    fresnel : function that returns the Fresnel reflectance of the lobe
    node_counts : number of quadrature nodes along and across the plane of incidence

    The integral is taken over the slopes of the half vector. Gauss-Legendre rules with nodes that are dense
    near the peak of the lobe resolve narrow peaks and grazing angles; the 80 x 80 directions of the published
    method do not.

    Source: [dEonLuebke2007] section 14.3, for the definition of rho_dt.
    """
    cosine, roughness = np.broadcast_arrays(np.asarray(cos_theta, float), np.asarray(m, float))
    c, m = np.clip(cosine[..., None, None], _MIN_COSINE, 1.0), roughness[..., None, None]
    tangent = np.sqrt(1.0 - c**2) / c
    y, dy = _slope_quadrature(np.zeros_like(c), 1.0 / c, m, node_counts[1])
    half_width = np.sqrt(np.maximum(c**-2 - y**2, 0.0))
    y, dy, half_width = (np.swapaxes(a, -1, -2) for a in (y, dy, half_width))
    x, dx = _slope_quadrature(tangent - half_width, tangent + half_width, m, node_counts[0])
    n_h = 1.0 / np.sqrt(1.0 + x**2 + y**2)
    v_h = c * (1.0 + tangent * x) * n_h
    n_l = np.maximum(2.0 * v_h * n_h - c, 0.0)
    reflected = n_l * lobe(Cosines(n_l, c, n_h, v_h), m, fresnel)
    # The half vector's solid angle is n_h^3 dx dy; the light's is 4 v_h times as large. 2 is for y and -y.
    albedo: Floats = (8.0 * reflected * v_h * n_h**3 * dx * dy).sum(axis=(-2, -1))
    return albedo


def _slope_quadrature(
    low_slope: Floats, high_slope: Floats, m: Floats, node_count: int
) -> tuple[Floats, Floats]:
    """Return quadrature nodes and weights for slopes from `low_slope` to `high_slope`, along the last axis.

    The nodes are dense within m of slope 0, where a lobe of roughness m peaks.
    """
    nodes_unit, weight = np.polynomial.legendre.leggauss(node_count)
    first, last = np.arctan(low_slope / m), np.arctan(high_slope / m)
    t = np.tan(0.5 * (first + last) + 0.5 * (last - first) * nodes_unit)
    return m * t, m * (1.0 + t**2) * 0.5 * (last - first) * weight


@cache
def albedo_table(model_name: str = "kelemen", fresnel_name: str = "schlick") -> NDArray[np.float32]:
    """Return the shader's table (roughness, cosine, 2) of directional albedo and mean albedo [-].

    Roughnesses and cosines are TABLE_ROUGHNESSES and TABLE_COSINES.

    model_name, fresnel_name : names of the specular model and of the Fresnel function, in MODELS and FRESNEL
    """
    lobe, reflectance = MODELS[model_name].lobe, FRESNEL[fresnel_name]
    # row by row, so that the nodes fit into the CPU's cache
    rows = [
        directional_albedo(TABLE_COSINES, m, lobe, reflectance, _TABLE_NODE_COUNTS) for m in TABLE_ROUGHNESSES
    ]
    rho = np.stack(rows)
    mean = np.asarray(2.0 * np.trapezoid(rho * TABLE_COSINES, TABLE_COSINES, axis=1))[:, None]
    return np.stack([rho, np.broadcast_to(mean, rho.shape)], axis=-1).astype(np.float32)
