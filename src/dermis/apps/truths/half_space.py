"""Exact reflection of light by an index-matched, isotropically scattering half-space."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.errors import refuse

Floats = NDArray[np.float64]
_QUADRATURE_NODE_COUNT = 64
_H_FUNCTION_ITERATIONS = 500


def h_function(cosine: ArrayLike, albedo: float) -> Floats:
    """Return Chandrasekhar's H function, from which the reflection of a half-space is computed [-].

    cosine : cosines of angles to the normal, an array of any shape
    albedo : single-scattering albedo, below 1 [-]

    The integral equation of H is solved by iteration at Gaussian nodes. It is written as an equation for
    1 / H, a sum of positive terms, so that no digits are lost for albedos near 1.

    Source: [Chandrasekhar1960] section 38.
    """
    if not 0.0 <= albedo < 1.0:
        refuse("half-space", "an albedo from 0 to below 1", f"got {albedo:g}", "Correct it")
    mu, weight = _gauss_legendre()
    kernel, root = 0.5 * albedo * weight * mu, np.sqrt(1.0 - albedo)
    H = np.ones(_QUADRATURE_NODE_COUNT)
    for _ in range(_H_FUNCTION_ITERATIONS):
        H = 0.5 * (H + 1.0 / (root + (kernel * H / (mu[:, None] + mu)).sum(axis=1)))
    mu_out = np.asarray(cosine, np.float64)[..., None]
    return np.asarray(1.0 / (root + (kernel * H / (mu_out + mu)).sum(axis=-1)))


def directional_albedo(cosine: ArrayLike, albedo: float) -> Floats:
    """Return the reflectance of a half-space for parallel light [-].

    cosine : cosine of the angle between light and normal
    albedo : single-scattering albedo [-]
    """
    return np.asarray(1.0 - np.sqrt(1.0 - albedo) * h_function(cosine, albedo))


def diffuse_albedo(albedo: float) -> float:
    """Return the reflectance of a half-space for uniform light from all directions [-].

    albedo : single-scattering albedo [-]
    """
    mu, weight = _gauss_legendre()
    return float((2.0 * weight * mu * directional_albedo(mu, albedo)).sum())


def reflected_radiance(cosine_in: ArrayLike, cosine_out: ArrayLike, albedo: float) -> Floats:
    """Return the reflected radiance of a half-space, divided by its irradiance by parallel light [1/sr].

    cosine_in : cosine of the angle between light and normal
    cosine_out : cosine of the angle between view and normal
    albedo : single-scattering albedo [-]

    Source: [Chandrasekhar1960] section 33; the ratio is S / (4 pi cosine_in cosine_out), with the scattering
    function S.
    """
    mu, view = np.asarray(cosine_in, np.float64), np.asarray(cosine_out, np.float64)
    H = h_function(mu, albedo) * h_function(view, albedo)
    return np.asarray(albedo / (4.0 * np.pi) * H / (mu + view))


def _gauss_legendre() -> tuple[Floats, Floats]:
    """Return nodes and weights of Gauss-Legendre quadrature on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE_NODE_COUNT)
    return 0.5 * (nodes + 1.0), 0.5 * weights
