"""How far from where it enters light leaves, as all targets are compared by it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.media import Floats
from dermis.optics.radial import TINY, RadialProfile

_NARROWEST_MM, _WIDEST_MM, _RADII = 1e-4, 1000.0, 800
_ANGLES = 256  # of the integral across an edge


def radii() -> Floats:
    """Radii that every curve is kept at: 0, and 2 % apart from a tenth of a micrometre on, (n,) [mm]."""
    return np.concatenate([[0.0], np.geomspace(_NARROWEST_MM, _WIDEST_MM, _RADII)])


@dataclass(frozen=True)
class Curve:
    """What leaves a half-space around a thin beam, cumulatively, in red, green and blue.

    radii_mm : (n,) increasing from 0 [mm]
    share : (n, 3) of the light that leaves anywhere, how much leaves within each radius, 0 to 1 [-]
    energy : (3,) light that leaves anywhere, per light that enters [-]
    """

    radii_mm: Floats
    share: Floats
    energy: Floats

    @classmethod
    def of(cls, within: Callable[[Floats], Floats], energy: ArrayLike) -> Curve:
        """The curve of a closed form.

        within : share (n, 3) of what leaves anywhere, within radii (n,) [mm]
        """
        grid = radii()
        return cls(grid, np.asarray(within(grid), np.float64), np.asarray(energy, np.float64))

    @classmethod
    def of_profile(cls, profile: RadialProfile, entering: float = 1.0) -> Curve:
        """The curve of a radial profile in three channels.

        entering : share of the incident light that enters, where the profile is per incident light [-]
        """
        total = profile.total
        within = np.concatenate([np.zeros((1, 3)), np.cumsum(profile.ring_energy, axis=0)])
        share = within / np.maximum(total, TINY)
        return cls.of(lambda r: between(r, profile.edges_mm, share), total / entering)

    def within(self, radius_mm: ArrayLike) -> Floats:
        """Share of what leaves anywhere that leaves within distances r, (..., 3) [-]."""
        r = np.asarray(radius_mm, np.float64)
        columns = [np.interp(r, self.radii_mm, self.share[:, i]) for i in range(3)]
        return np.stack(columns, axis=-1)

    def edge(self, distance_mm: ArrayLike) -> Floats:
        """Light that leaves at a distance x from a straight edge of even light, (..., 3) [-].

        1/2 + 1/pi int asin(min(1, x/r)) dP(r), which by parts is 1/2 + 1/pi int_0^(pi/2) P(x / sin t) dt:
        1 far inside the light, 0 far outside of it.
        """
        x = np.asarray(distance_mm, np.float64)
        t = (np.arange(_ANGLES) + 0.5) * (0.5 * np.pi / _ANGLES)
        mean = self.within(np.abs(x)[..., None] / np.sin(t)).mean(axis=-2)
        return np.asarray(0.5 + 0.5 * np.sign(x)[..., None] * mean)

    def radius_of(self, share: float) -> Floats:
        """Radius within which a share of what leaves does leave, (3,) [mm]."""
        return np.array([np.interp(share, self.share[:, i], self.radii_mm) for i in range(3)])

    def with_energy(self, energy: ArrayLike) -> Curve:
        """The same shape, with other totals (3,)."""
        return Curve(self.radii_mm, self.share, np.asarray(energy, np.float64))


def between(radius_mm: Floats, edges_mm: Floats, share: Floats) -> Floats:
    """A cumulative table (k, 3) that begins at radius 0, monotonically interpolated at other radii."""
    from scipy.interpolate import PchipInterpolator

    read = PchipInterpolator(np.log(edges_mm[1:]), share[1:], axis=0)
    inside = np.clip(radius_mm, edges_mm[1], edges_mm[-1])
    nearest = np.minimum(radius_mm / edges_mm[1], 1.0)  # within the first ring R(r) goes with 1/r
    return np.asarray(read(np.log(inside)) * nearest[:, None])
