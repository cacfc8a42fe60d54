"""Reflectance of the skin's surface by angle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Fresnel = Callable[[Floats], Floats]
"""Reflectance [-] by the cosine between view and half vector."""

SKIN_F0 = 0.028
"""Reflectance of skin at normal incidence, ((1.4 - 1) / (1.4 + 1))^2 rounded [-] [dEonLuebke2007]."""

SKIN_ETA = 1.4
"""Index of refraction of skin [-] [Dudash2007]."""


def schlick(cos_theta: ArrayLike, f0: float = SKIN_F0) -> Floats:
    """Fresnel reflectance at the angle between view and half vector [-]. Source: [Schlick1994]."""
    c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
    reflectance: Floats = f0 + (1.0 - f0) * (1.0 - c) ** 5
    return reflectance


def dielectric(cos_theta: ArrayLike, eta: float = SKIN_ETA) -> Floats:
    """Exact reflectance of unpolarised light that comes from air onto a dielectric [-].

    eta : index of refraction, 1 or more

    Source: [CookTorrance1982], in their form for unpolarised light.
    """
    c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
    g = np.sqrt(eta**2 - 1.0 + c**2)
    across = (g - c) / (g + c)
    along = (c * (g + c) - 1.0) / (c * (g - c) + 1.0)
    return np.asarray(0.5 * across**2 * (1.0 + along**2))


FRESNEL: dict[str, Fresnel] = {"schlick": schlick, "exact": dielectric}
"""Both ways, by the names that scenes use."""


def hemispherical_reflectance(fresnel: Fresnel = dielectric, nodes: int = 64) -> float:
    """Share of light from everywhere that a smooth surface reflects, 2 int F mu dmu [-]."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    mu = 0.5 * (x + 1.0)
    return float(w @ (fresnel(mu) * mu))
