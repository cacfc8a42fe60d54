"""Fresnel reflectance of skin, and what becomes of the energy that the surface does not pass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

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


@dataclass(frozen=True)
class EnergyModel:
    """What enters and leaves the skin, with c = 1 unless `returned` divides by the mean of what leaves.

    f = (1 - loss rho_s rho_dt(n.l)) (1 - loss rho_s rho_dt(n.v)) / (pi c)

    loss : factor of the surface's albedo: 0 for no term, 1, or pi
    returned : whether light that the surface throws back inside comes out after all
    """

    loss: float
    returned: bool

    def entering_fraction(self, albedo: ArrayLike, rho_s: float) -> Floats:
        """Share of light from a direction that enters, by the surface's albedo there [-]."""
        return np.maximum(0.0, 1.0 - self.loss * rho_s * np.asarray(albedo, float))

    def exitance_factor(self, albedo: ArrayLike, mean: ArrayLike, rho_s: float) -> Floats:
        """What leaves in a direction, of light that would leave evenly [-].

        albedo : of the surface there
        mean : albedo over all directions, weighed by their cosine
        """
        lost = self.loss * rho_s * np.asarray(mean, float) if self.returned else 0.0
        return np.asarray(self.entering_fraction(albedo, rho_s) / np.maximum(1.0 - lost, 0.5))

    def furnace_radiance(self, albedo: ArrayLike, mean: ArrayLike, rho_s: float) -> Floats:
        """Outgoing over incoming radiance of white skin under the same light from everywhere [-]."""
        inside = 1.0 - self.loss * rho_s * np.asarray(mean, float)
        return np.asarray(
            rho_s * np.asarray(albedo, float) + inside * self.exitance_factor(albedo, mean, rho_s)
        )


ENERGY: dict[str, EnergyModel] = {
    "none": EnergyModel(0.0, returned=False),
    "published": EnergyModel(np.pi, returned=False),
    "full": EnergyModel(1.0, returned=True),
}
"""By the names that scenes use.

`published` takes the book's rho_dt [dEonLuebke2007], whose lobe and integral lack 1/pi: it overstates the
loss by pi where diffuse light is divided by pi. `full` divides, and by the mean of what leaves it returns
light that the surface reflects back inside: as a matte layer under a glossy one [Kelemen2001].
"""
