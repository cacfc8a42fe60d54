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
    """Return Schlick's approximation of the Fresnel reflectance [-].

    cos_theta : cosine of the angle between view and half vector
    f0 : reflectance at normal incidence [-]

    Source: [Schlick1994].
    """
    c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
    reflectance: Floats = f0 + (1.0 - f0) * (1.0 - c) ** 5
    return reflectance


def dielectric(cos_theta: ArrayLike, eta: float = SKIN_ETA) -> Floats:
    """Return the exact Fresnel reflectance for unpolarised light from air onto a dielectric [-].

    cos_theta : cosine of the angle between view and half vector
    eta : index of refraction of the dielectric, 1 or more [-]

    Source: [CookTorrance1982], in the form for unpolarised light.
    """
    c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
    g = np.sqrt(eta**2 - 1.0 + c**2)
    across = (g - c) / (g + c)
    along = (c * (g + c) - 1.0) / (c * (g - c) + 1.0)
    return np.asarray(0.5 * across**2 * (1.0 + along**2))


FRESNEL: dict[str, Fresnel] = {"schlick": schlick, "exact": dielectric}
"""Fresnel functions by their names in scene files."""


def hemispherical_reflectance(fresnel: Fresnel = dielectric, node_count: int = 64) -> float:
    """Return the reflectance of a smooth surface under a uniform sky [-].

    The result is twice the integral of F(mu) mu over mu from 0 to 1.

    fresnel : function that returns the Fresnel reflectance F from the cosine mu of the angle of incidence
    node_count : number of quadrature nodes
    """
    x, w = np.polynomial.legendre.leggauss(node_count)
    mu = 0.5 * (x + 1.0)
    return float(w @ (fresnel(mu) * mu))


@dataclass(frozen=True)
class EnergyConservationScheme:
    """Energy conservation scheme: reduces diffuse light by the light that the specular lobe reflects.

    The diffuse BRDF is albedo / pi times (1 - k rho_dt(n.l)) (1 - k rho_dt(n.v)) / c. Here rho_dt is the
    directional albedo of the lobe, and k is `loss` times the specular strength rho_s. The divisor c is 1
    minus k times the mean albedo if `returns_internal_light` is true, otherwise 1.

    loss : ratio of the subtracted light to the light that the lobe reflects: 1 conserves energy, and pi is
        the published value
    returns_internal_light : whether light that the surface reflects back into the skin leaves the skin later;
        if False, this light is lost
    """

    loss: float
    returns_internal_light: bool

    def entering_fraction(self, albedo: ArrayLike, rho_s: float) -> Floats:
        """Return the fraction of the light from one direction that enters the skin [-].

        albedo : directional albedo of the lobe for this direction [-]
        rho_s : specular strength [-]
        """
        return np.maximum(0.0, 1.0 - self.loss * rho_s * np.asarray(albedo, float))

    def exitance_factor(self, albedo: ArrayLike, mean_albedo: ArrayLike, rho_s: float) -> Floats:
        """Return the factor by which the surface scales diffuse radiance towards a viewer [-].

        albedo : directional albedo of the lobe for the direction to the viewer [-]
        mean_albedo : mean albedo of the lobe, cosine-weighted over the hemisphere [-]
        rho_s : specular strength [-]
        """
        lost = self.loss * rho_s * np.asarray(mean_albedo, float) if self.returns_internal_light else 0.0
        return np.asarray(self.entering_fraction(albedo, rho_s) / np.maximum(1.0 - lost, 0.5))

    def furnace_radiance(self, albedo: ArrayLike, mean_albedo: ArrayLike, rho_s: float) -> Floats:
        """Return the radiance of white skin under uniform incident radiance of 1 [-].

        The result is 1 if the scheme conserves energy (white furnace test).

        albedo : directional albedo of the lobe for the direction to the viewer [-]
        mean_albedo : mean albedo of the lobe [-]
        rho_s : specular strength [-]
        """
        inside = 1.0 - self.loss * rho_s * np.asarray(mean_albedo, float)
        return np.asarray(
            rho_s * np.asarray(albedo, float) + inside * self.exitance_factor(albedo, mean_albedo, rho_s)
        )


ENERGY_SCHEMES: dict[str, EnergyConservationScheme] = {
    "none": EnergyConservationScheme(0.0, returns_internal_light=False),
    "published": EnergyConservationScheme(np.pi, returns_internal_light=False),
    "full": EnergyConservationScheme(1.0, returns_internal_light=True),
}
"""Energy conservation schemes by their names in scene files.

`published` uses rho_dt of the book [dEonLuebke2007], whose lobe and integral lack 1/pi: for diffuse light
that is divided by pi, it overestimates the loss by the factor pi. `full` includes 1/pi, and also returns the
light that the surface reflects back inside, as for a matte layer below a glossy one [Kelemen2001].
"""
