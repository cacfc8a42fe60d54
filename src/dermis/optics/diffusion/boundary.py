"""Reflection at a smooth dielectric surface, from outside and from inside."""

from __future__ import annotations

from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
DiffuseIntegral = Literal["polynomial", "exact"]


def normal_reflectance(eta: float) -> float:
    """Return the Fresnel reflectance at normal incidence [-]."""
    return ((eta - 1.0) / (eta + 1.0)) ** 2


def fresnel(cosine: ArrayLike, eta: float) -> Floats:
    """Return the Fresnel reflectance of unpolarised light by incident cosine [-].

    cosine : of the angle of incidence, 0 to 1
    eta : index of the far side over that of the near side; less than 1 for light that leaves the medium

    Source: [Born1999] section 1.5.
    """
    c = np.asarray(cosine, dtype=np.float64)
    sine2 = (1.0 - c**2) / eta**2
    t = np.sqrt(np.maximum(1.0 - sine2, 0.0))
    across = (c - eta * t) / (c + eta * t)
    along = (eta * c - t) / (eta * c + t)
    return np.asarray(np.where(sine2 < 1.0, 0.5 * (across**2 + along**2), 1.0))


@cache
def internal_moment(order: int, eta: float, nodes: int = 64) -> float:
    """Return the moment of the internal reflectance: integral of F(mu) mu^order over cosines 0 to 1 [-].

    Source: [dEonIrving2011] section 3.
    """
    if eta == 1.0:
        return 0.0
    critical = np.sqrt(1.0 - 1.0 / eta**2)
    x, w = np.polynomial.legendre.leggauss(nodes)
    # F has a square-root singularity at the critical angle; substituting the transmitted cosine removes it.
    t = 0.5 * (x + 1.0)
    mu = np.sqrt(critical**2 + (t / eta) ** 2)
    inside = fresnel(np.minimum(mu, 1.0), 1.0 / eta) * mu**order * t / (eta**2 * mu)
    return float(critical ** (order + 1) / (order + 1) + 0.5 * w @ inside)


def diffuse_reflectance(eta: float, kind: DiffuseIntegral = "polynomial") -> float:
    """Return the internal reflectance of the surface for diffuse light, F_dr [-].

    kind : the polynomial used by the published models, or the exact integral

    Source: [Egan1973]; as printed in [Jensen2001].
    """
    if eta == 1.0:
        return 0.0
    if kind == "exact":
        return 2.0 * internal_moment(1, eta)
    return -1.4399 / eta**2 + 0.7099 / eta + 0.6681 + 0.0636 * eta


def boundary_mismatch(eta: float, kind: DiffuseIntegral = "polynomial") -> float:
    """Return A = (1 + F_dr) / (1 - F_dr) of the diffusion boundary condition; 1 if index-matched [-].

    Source: [Jensen2001] section 2.3.
    """
    F_dr = diffuse_reflectance(eta, kind)
    return (1.0 + F_dr) / (1.0 - F_dr)
