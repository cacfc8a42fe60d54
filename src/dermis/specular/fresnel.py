"""Fresnel reflectance of skin, and energy conservation between specular and diffuse light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Fresnel = Callable[[Floats], Floats]
"""Function from the cosine between view and half vector to the Fresnel reflectance [-]."""

SKIN_F0 = 0.028
"""Reflectance of skin at normal incidence, ((1.4 - 1) / (1.4 + 1))^2 rounded [-] [dEonLuebke2007]."""

SKIN_ETA = 1.4
"""Index of refraction of skin [-] [Dudash2007]."""


def schlick(cos_theta: ArrayLike, f0: float = SKIN_F0) -> Floats:
    """Return Schlick's approximation of the Fresnel reflectance [-]. Source: [Schlick1994].

    cos_theta : cosine between view and half vector
    """
    c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
    reflectance: Floats = f0 + (1.0 - f0) * (1.0 - c) ** 5
    return reflectance


def dielectric(cos_theta: ArrayLike, eta: float = SKIN_ETA) -> Floats:
    """Return the exact Fresnel reflectance for unpolarised light from air onto a dielectric [-].

    eta : index of refraction, 1 or more

    Source: [CookTorrance1982], in their form for unpolarised light.
    """
    c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
    g = np.sqrt(eta**2 - 1.0 + c**2)
    across = (g - c) / (g + c)
    along = (c * (g + c) - 1.0) / (c * (g - c) + 1.0)
    return np.asarray(0.5 * across**2 * (1.0 + along**2))


FRESNEL: dict[str, Fresnel] = {"schlick": schlick, "exact": dielectric}
"""Fresnel functions by their names in scene files."""


def hemispherical_reflectance(fresnel: Fresnel = dielectric, nodes: int = 64) -> float:
    """Return the reflectance of a smooth surface under uniform illumination, 2 int F mu dmu [-]."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    mu = 0.5 * (x + 1.0)
    return float(w @ (fresnel(mu) * mu))


@dataclass(frozen=True)
class EnergyModel:
    """Energy conservation of the diffuse light below a specular lobe.

    f = (1 - loss rho_s rho_dt(n.l)) (1 - loss rho_s rho_dt(n.v)) / (pi c), where c = 1 unless `returned`
    divides by the mean of the second factor.

    loss : factor of the lobe's albedo: 0 for no correction, 1, or pi
    returned : whether light that the surface reflects back inside leaves the skin later
    """

    loss: float
    returned: bool

    def entering_fraction(self, albedo: ArrayLike, rho_s: float) -> Floats:
        """Return the fraction of light from a direction that enters the skin, from the lobe's albedo [-]."""
        return np.maximum(0.0, 1.0 - self.loss * rho_s * np.asarray(albedo, float))

    def exitance_factor(self, albedo: ArrayLike, mean: ArrayLike, rho_s: float) -> Floats:
        """Return the factor by which the surface scales diffuse radiance that leaves in a direction [-].

        albedo : directional albedo of the lobe
        mean : mean albedo, cosine-weighted
        rho_s : specular strength
        """
        lost = self.loss * rho_s * np.asarray(mean, float) if self.returned else 0.0
        return np.asarray(self.entering_fraction(albedo, rho_s) / np.maximum(1.0 - lost, 0.5))

    def furnace_radiance(self, albedo: ArrayLike, mean: ArrayLike, rho_s: float) -> Floats:
        """Return the outgoing radiance of white skin under uniform incoming radiance 1 [-]."""
        inside = 1.0 - self.loss * rho_s * np.asarray(mean, float)
        return np.asarray(
            rho_s * np.asarray(albedo, float) + inside * self.exitance_factor(albedo, mean, rho_s)
        )


ENERGY: dict[str, EnergyModel] = {
    "none": EnergyModel(0.0, returned=False),
    "published": EnergyModel(np.pi, returned=False),
    "full": EnergyModel(1.0, returned=True),
}
"""Energy models by their names in scene files.

`published` uses rho_dt of the book [dEonLuebke2007], whose lobe and integral lack 1/pi, and so overestimates
the loss by pi for diffuse light that is divided by pi. `full` has the factor and also returns the light that
the surface reflects back inside, as for a matte layer below a glossy one [Kelemen2001].
"""
