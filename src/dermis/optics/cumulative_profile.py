"""Cumulative diffusion profiles, a common form for comparing diffusion models and renderers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.media import Floats
from dermis.optics.radial import SMALLEST_FLOAT, RadialProfile

_MIN_RADIUS_MM, _MAX_RADIUS_MM, _RADIUS_COUNT = 1e-4, 1000.0, 800
_EDGE_RESPONSE_ANGLE_COUNT = 256  # samples of the integral in `edge_response`


def cumulative_radii() -> Floats:
    """Return the radii (n,) at which every cumulative profile is sampled, 0 and then log-spaced [mm]."""
    return np.concatenate([[0.0], np.geomspace(_MIN_RADIUS_MM, _MAX_RADIUS_MM, _RADIUS_COUNT)])


@dataclass(frozen=True)
class CumulativeProfile:
    """Fraction of the emerging light that leaves within each radius of a narrow beam, in red, green and blue.

    radii_mm : (n,) radii, increasing from 0 [mm]
    fraction : (n, 3) light that emerges within each radius, divided by all emerging light, 0 to 1 [-]
    energy : (3,) all emerging light, divided by the light that enters [-]
    """

    radii_mm: Floats
    fraction: Floats
    energy: Floats

    @classmethod
    def from_function(
        cls, fraction_within: Callable[[Floats], Floats], energy: ArrayLike
    ) -> CumulativeProfile:
        """Return the cumulative profile that is sampled from a function of the radius.

        fraction_within : function from radii (n,) [mm] to the fractions (n, 3) of the emerging light that
            leave within them [-]
        energy : (3,) all emerging light, divided by the light that enters [-]
        """
        grid = cumulative_radii()
        return cls(grid, np.asarray(fraction_within(grid), np.float64), np.asarray(energy, np.float64))

    @classmethod
    def from_radial_profile(cls, profile: RadialProfile, entering_fraction: float = 1.0) -> CumulativeProfile:
        """Return the cumulative profile of a radial profile with three channels.

        entering_fraction : fraction of the incident light that enters, if the profile is relative to the
            incident power; 1 if the profile is relative to the power that enters [-]
        """
        total = profile.total
        energy_within = np.concatenate([np.zeros((1, 3)), np.cumsum(profile.ring_energy, axis=0)])
        fraction = energy_within / np.maximum(total, SMALLEST_FLOAT)
        energy = total / entering_fraction
        return cls.from_function(lambda r: interpolate_cumulative(r, profile.edges_mm, fraction), energy)

    def fraction_within(self, radius_mm: ArrayLike) -> Floats:
        """Return the fraction (..., 3) of all emerging light that leaves within each radius [-]."""
        r = np.asarray(radius_mm, np.float64)
        columns = [np.interp(r, self.radii_mm, self.fraction[:, i]) for i in range(3)]
        return np.stack(columns, axis=-1)

    def edge_response(self, distance_mm: ArrayLike) -> Floats:
        """Return the radiosity (..., 3) near a straight shadow edge, relative to full light [-].

        distance_mm : signed distances x from the edge, positive in the uniformly lit half-plane [mm]

        P(r) is the fraction of the light within a radius r. The response at x > 0 is 1/2 plus 1/pi times the
        integral of P(x / sin t) over t from 0 to pi/2. The response at -x is 1 minus the response at x.
        """
        x = np.asarray(distance_mm, np.float64)
        t = (np.arange(_EDGE_RESPONSE_ANGLE_COUNT) + 0.5) * (0.5 * np.pi / _EDGE_RESPONSE_ANGLE_COUNT)
        mean = self.fraction_within(np.abs(x)[..., None] / np.sin(t)).mean(axis=-2)
        return np.asarray(0.5 + 0.5 * np.sign(x)[..., None] * mean)

    def radius_at_fraction(self, light_fraction: float) -> Floats:
        """Return the radius (3,) within which a given fraction of the emerging light leaves [mm]."""
        return np.array([np.interp(light_fraction, self.fraction[:, i], self.radii_mm) for i in range(3)])

    def with_energy(self, energy: ArrayLike) -> CumulativeProfile:
        """Return the profile scaled to another total reflectance; the field `fraction` stays the same.

        energy : (3,) new total reflectance [-]
        """
        return CumulativeProfile(self.radii_mm, self.fraction, np.asarray(energy, np.float64))


def interpolate_cumulative(radius_mm: Floats, edges_mm: Floats, fraction_within_edges: Floats) -> Floats:
    """Return the fractions (n, c) of light within radii, by monotonic splines through tabulated values [-].

    radius_mm : (n,) radii of the result [mm]
    edges_mm : (k,) tabulated radii, the first 0 [mm]
    fraction_within_edges : (k, c) tabulated fractions [-]
    """
    from scipy.interpolate import PchipInterpolator

    interpolate = PchipInterpolator(np.log(edges_mm[1:]), fraction_within_edges[1:], axis=0)
    clamped = np.clip(radius_mm, edges_mm[1], edges_mm[-1])
    linear = np.minimum(radius_mm / edges_mm[1], 1.0)  # within the first ring R(r) is proportional to 1/r
    return np.asarray(interpolate(np.log(clamped)) * linear[:, None])
