"""Fresnel reflection at the smooth surface of a medium, and the boundary mismatch A of diffusion theory."""

from __future__ import annotations

from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
DiffuseIntegral = Literal["polynomial", "exact"]


def normal_reflectance(eta: float) -> float:
    """Return the Fresnel reflectance at normal incidence for an index of refraction relative to air [-]."""
    return ((eta - 1.0) / (eta + 1.0)) ** 2


def fresnel(cosine: ArrayLike, eta: float) -> Floats:
    """Return the Fresnel reflectance for unpolarised light [-].

    cosine : cosine of the angle of incidence, 0 to 1
    eta : index of refraction behind the surface, divided by the index in front of it; less than 1 for light
        that leaves the medium

    Source: [Born1999] section 1.5.
    """
    c = np.asarray(cosine, dtype=np.float64)
    sine2 = (1.0 - c**2) / eta**2
    t = np.sqrt(np.maximum(1.0 - sine2, 0.0))
    across = (c - eta * t) / (c + eta * t)
    along = (eta * c - t) / (eta * c + t)
    return np.asarray(np.where(sine2 < 1.0, 0.5 * (across**2 + along**2), 1.0))


@cache
def internal_moment(cosine_power: int, eta: float, node_count: int = 64) -> float:
    """Return a moment of the internal Fresnel reflectance F: the integral of F(mu) mu^p from mu = 0 to 1 [-].

    cosine_power : power p of the cosine mu
    eta : index of refraction relative to air [-]
    node_count : number of quadrature nodes

    Source: [dEonIrving2011] section 3.
    """
    if eta == 1.0:
        return 0.0
    critical = np.sqrt(1.0 - 1.0 / eta**2)
    x, w = np.polynomial.legendre.leggauss(node_count)
    # F has a square-root singularity at the critical angle; substituting the transmitted cosine removes it.
    t = 0.5 * (x + 1.0)
    mu = np.sqrt(critical**2 + (t / eta) ** 2)
    inside = fresnel(np.minimum(mu, 1.0), 1.0 / eta) * mu**cosine_power * t / (eta**2 * mu)
    return float(critical ** (cosine_power + 1) / (cosine_power + 1) + 0.5 * w @ inside)


def diffuse_fresnel_reflectance(eta: float, integral_method: DiffuseIntegral = "polynomial") -> float:
    """Return the reflectance F_dr of the surface for diffuse light from inside the medium [-].

    eta : index of refraction relative to air [-]
    integral_method : "polynomial" for the polynomial fit that the published dipole and multipole use, or
        "exact" for the integral

    Source: [Egan1973]; as printed in [Jensen2001].
    """
    if eta == 1.0:
        return 0.0
    if integral_method == "exact":
        return 2.0 * internal_moment(1, eta)
    return -1.4399 / eta**2 + 0.7099 / eta + 0.6681 + 0.0636 * eta


def boundary_mismatch(eta: float, integral_method: DiffuseIntegral = "polynomial") -> float:
    """Return the boundary mismatch A = (1 + F_dr) / (1 - F_dr), which is 1 at an index-matched surface [-].

    F_dr is the `diffuse_fresnel_reflectance`. In diffusion theory, the fluence, extrapolated linearly beyond
    the surface, is zero at the height 2 A D, where D is the diffusion coefficient.

    eta : index of refraction relative to air [-]
    integral_method : "polynomial" or "exact", see `diffuse_fresnel_reflectance`

    Source: [Jensen2001] section 2.3.
    """
    F_dr = diffuse_fresnel_reflectance(eta, integral_method)
    return (1.0 + F_dr) / (1.0 - F_dr)
