"""Scattering layers at one wavelength, and the shares of light they reflect, transmit and absorb."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from dermis.base.errors import refuse
from dermis.optics.media import SKIN_ETA, Floats


def check_mean_cosine(g: float) -> None:
    """Raises DermisError for a mean cosine that no phase function has."""
    if not -1.0 < g < 1.0:
        refuse("scattering", "a mean cosine between -1 and 1", f"{g:g} came", "Correct it")


@dataclass(frozen=True)
class ScatteringLayer:
    """One homogeneous layer at one wavelength, with the phase function of Henyey and Greenstein.

    sigma_a, sigma_s : coefficients of absorption and (not reduced) scattering, 0 or more [1/mm]
    thickness_mm : infinite for a half-space [mm]
    g : mean cosine of the deflection [-]
    eta : index of refraction relative to air [-]
    """

    sigma_a: float
    sigma_s: float
    thickness_mm: float = float("inf")
    g: float = 0.0
    eta: float = SKIN_ETA

    def __post_init__(self) -> None:
        culprit = "scattering layer"
        if not (0.0 <= self.sigma_a < np.inf and 0.0 <= self.sigma_s < np.inf):
            came = f"absorption {self.sigma_a:g} and scattering {self.sigma_s:g} came"
            refuse(culprit, "absorption and scattering of 0 or more [1/mm]", came, "Correct them")
        if not self.thickness_mm > 0.0:
            refuse(culprit, "a thickness above 0 mm", f"{self.thickness_mm:g} came", "Correct it")
        if np.isinf(self.thickness_mm) and self.sigma_t == 0.0:
            came = "it neither absorbs nor scatters"
            refuse(culprit, "an infinite layer to stop light", came, "Give it a thickness")
        check_mean_cosine(self.g)
        if not 1.0 <= self.eta <= 2.5:
            refuse(culprit, "an index of refraction from 1 to 2.5", f"{self.eta:g} came", "Correct it")

    @property
    def sigma_t(self) -> float:
        """Extinction [1/mm]."""
        return self.sigma_a + self.sigma_s

    @property
    def albedo(self) -> float:
        """Share of the extinction that is scattering; 0 without extinction [-]."""
        return self.sigma_s / self.sigma_t if self.sigma_t > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class SlabResult:
    """Where the beam's power went, in shares of the incident power [-]; `_se` are standard errors.

    The specular, total, unscattered, absorbed and unfinished shares sum to 1. The errors are binomial, and 0
    where no photon arrived.

    photons : traced, all of which had entered the stack
    edges_mm : (n + 1,) of the rings, from 0 [mm]
    specular : reflected by the top face
    reflectance, transmittance : (n,) R(r) and T(r) of scattered light, averaged over each ring [1/mm2]
    total_reflectance, total_transmittance : scattered light at any radius
    overflow_reflectance, overflow_transmittance : the part of it beyond the last edge
    unscattered_reflectance, unscattered_transmittance : left on the axis without having scattered
    absorbed : (layers,)
    unfinished : given up after very many scatterings; above 0 only where almost nothing absorbs
    """

    photons: int
    edges_mm: Floats
    specular: float
    reflectance: Floats
    reflectance_se: Floats
    transmittance: Floats
    transmittance_se: Floats
    total_reflectance: float
    total_reflectance_se: float
    total_transmittance: float
    total_transmittance_se: float
    overflow_reflectance: float
    overflow_transmittance: float
    unscattered_reflectance: float
    unscattered_transmittance: float
    absorbed: Floats
    absorbed_se: Floats
    unfinished: float

    @property
    def per_entering(self) -> SlabResult:
        """The same in shares of the light that entered, as diffusion profiles are defined."""
        names = [field.name for field in fields(self)][3:]
        entered = 1.0 - self.specular
        return replace(self, specular=0.0, **{name: getattr(self, name) / entered for name in names})
