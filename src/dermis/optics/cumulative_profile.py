"""Cumulative diffusion profiles, by which profiles of different models and renderers are compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.media import Floats
from dermis.optics.radial import TINY, RadialProfile

_MIN_RADIUS_MM, _MAX_RADIUS_MM, _RADII = 1e-4, 1000.0, 800
_ANGLES = 256  # samples of the integral in `edge_response`


def radii() -> Floats:
    """Return the radii of all cumulative profiles, (n,) [mm]: 0, then log-spaced in steps of 2 %."""
    return np.concatenate([[0.0], np.geomspace(_MIN_RADIUS_MM, _MAX_RADIUS_MM, _RADII)])


@dataclass(frozen=True)
class CumulativeProfile:
    """Fraction of the light emerging around a narrow beam by radius, in red, green and blue.

    radii_mm : (n,) increasing from 0 [mm]
    fraction : (n, 3) of all emerging light, fraction within each radius, 0 to 1 [-]
    energy : (3,) emerging light per light that enters [-]
    """

    radii_mm: Floats
    fraction: Floats
    energy: Floats

    @classmethod
    def from_function(cls, within: Callable[[Floats], Floats], energy: ArrayLike) -> CumulativeProfile:
        """Return the profile of a function in closed form.

        within : function from radii (n,) [mm] to the fraction of all emerging light within them, (n,
            3)
        energy : (3,) emerging light per light that enters [-]
        """
        grid = radii()
        return cls(grid, np.asarray(within(grid), np.float64), np.asarray(energy, np.float64))

    @classmethod
    def from_radial_profile(cls, profile: RadialProfile, entering_fraction: float = 1.0) -> CumulativeProfile:
        """Return the cumulative form of a radial profile with three channels.

        entering_fraction : of the incident light, if the radial profile is per incident light [-]
        """
        total = profile.total
        energy_within = np.concatenate([np.zeros((1, 3)), np.cumsum(profile.ring_energy, axis=0)])
        fraction = energy_within / np.maximum(total, TINY)
        energy = total / entering_fraction
        return cls.from_function(lambda r: interpolate_cumulative(r, profile.edges_mm, fraction), energy)

    def fraction_within(self, radius_mm: ArrayLike) -> Floats:
        """Return the fraction of all emerging light within radii, (..., 3) [-]."""
        r = np.asarray(radius_mm, np.float64)
        columns = [np.interp(r, self.radii_mm, self.fraction[:, i]) for i in range(3)]
        return np.stack(columns, axis=-1)

    def edge_response(self, distance_mm: ArrayLike) -> Floats:
        """Return the emerging light at signed distances x from a straight shadow edge, (..., 3) [-].

        One half-plane is lit uniformly, where x is positive. The response is 1/2 + 1/pi int asin(min(1, x/r))
        dP(r), by parts 1/2 + 1/pi int_0^(pi/2) P(x / sin t) dt: 1 far inside the light and 0 far outside.
        """
        x = np.asarray(distance_mm, np.float64)
        t = (np.arange(_ANGLES) + 0.5) * (0.5 * np.pi / _ANGLES)
        mean = self.fraction_within(np.abs(x)[..., None] / np.sin(t)).mean(axis=-2)
        return np.asarray(0.5 + 0.5 * np.sign(x)[..., None] * mean)

    def radius_at_fraction(self, fraction: float) -> Floats:
        """Return the radius within which a fraction of the emerging light leaves, (3,) [mm]."""
        return np.array([np.interp(fraction, self.fraction[:, i], self.radii_mm) for i in range(3)])

    def with_energy(self, energy: ArrayLike) -> CumulativeProfile:
        """Return a profile of the same shape with other totals, (3,)."""
        return CumulativeProfile(self.radii_mm, self.fraction, np.asarray(energy, np.float64))


def interpolate_cumulative(radius_mm: Floats, edges_mm: Floats, fraction: Floats) -> Floats:
    """Interpolate a cumulative table (k, 3) that starts at radius 0 monotonically at other radii."""
    from scipy.interpolate import PchipInterpolator

    interpolate = PchipInterpolator(np.log(edges_mm[1:]), fraction[1:], axis=0)
    clamped = np.clip(radius_mm, edges_mm[1], edges_mm[-1])
    linear = np.minimum(radius_mm / edges_mm[1], 1.0)  # within the first ring R(r) is proportional to 1/r
    return np.asarray(interpolate(np.log(clamped)) * linear[:, None])
