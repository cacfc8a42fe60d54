"""Radial profiles as arrays: R(r) at radii, and the light that emerges through rings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.optics.fits.targets import PointTarget, RingTarget
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Floats

NOTABLE_FRACTION, TINY = 0.01, float(np.finfo(np.float64).tiny)
MIN_RADIUS_MM, MAX_RADIUS_MM = 1e-4, 60.0
"""Range of radii of a profile, over which errors are integrated [mm]."""


@dataclass(frozen=True)
class RadialProfile:
    """Diffusion profile around a point of entry, sampled at radii and integrated over rings, in c channels.

    name : of the medium
    model : by which the profile was computed
    radius_mm : (n,) increasing [mm]
    reflectance : (n, c) R(r) [1/mm2]
    total : (c,) integral of 2 pi r R(r) [-]
    edges_mm : (k + 1,) of the rings, starting at 0 [mm]
    ring_energy : (k, c) light that emerges through each ring [-]
    standard_error : (n, c) of R(r) if it is from photon counts, else None [1/mm2]
    total_error : (c,) standard error of the total, likewise [-]
    incident : whether the profile is per incident power (surface reflection excluded), not per power that
        enters
    warnings : reasons to doubt these numbers
    sources : citation keys
    """

    name: str
    model: str
    radius_mm: Floats
    reflectance: Floats
    total: Floats
    edges_mm: Floats
    ring_energy: Floats
    standard_error: Floats | None = None
    total_error: Floats | None = None
    incident: bool = False
    warnings: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()

    @property
    def finite_at_centre(self) -> bool:
        """Return whether R(r) is finite at the point of entry, which it is not for a beam."""
        return self.model not in ("layered", "montecarlo", "counted")

    def points(self) -> PointTarget:
        """Return the target for fits of R(r)."""
        return PointTarget(self.radius_mm, self.reflectance, self.total)

    def rings(self) -> RingTarget:
        """Return the target for fits of ring energies, also valid if R(r) is infinite at its centre."""
        return RingTarget(self.edges_mm, self.ring_energy, self.total)


def ring_edges(rings: int = 120) -> Floats:
    """Return the edges of a disc and log-spaced rings around it, (rings + 1,) [mm]."""
    return np.concatenate([[0.0], np.geomspace(1e-3, MAX_RADIUS_MM, rings)])


def radius_grid(count: int = 600) -> Floats:
    """Return log-spaced radii, (count,) [mm]."""
    return np.geomspace(MIN_RADIUS_MM, MAX_RADIUS_MM, count)


def resample(radius_mm: Floats, grid_mm: Floats, values: Floats) -> Floats:
    """Resample values (m, c) from a log-spaced grid at other radii, with a cubic spline in log r, (n, c)."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(np.log(grid_mm), values)(np.log(radius_mm)))


def enclosed_energy(radius_mm: Floats, grid_mm: Floats, reflectance: Floats) -> Floats:
    """Return the light that emerges within each radius, (n, c) [-], for R(r) on a log-spaced grid."""
    from scipy.integrate import cumulative_simpson

    rate = 2.0 * np.pi * grid_mm[:, None] ** 2 * reflectance  # per unit of log r
    inner = 0.5 * rate[:1]  # R is nearly constant within the first radius of the grid
    within = inner + cumulative_simpson(rate, x=np.log(grid_mm), axis=0, initial=0.0)
    energy = resample(np.maximum(radius_mm, grid_mm[0]), grid_mm, within)
    return np.where(radius_mm[:, None] > 0.0, energy, 0.0)


def missing_light_warnings(total: Floats, ring_energy: Floats) -> list[str]:
    """Return a warning if a notable fraction of the total (c,) is not in the rings (k, c)."""
    missing = float(((total - ring_energy.sum(axis=0)) / np.maximum(np.abs(total), TINY)).max())
    if missing < NOTABLE_FRACTION:
        return []
    return [f"{missing:.0%} of the light leaves beyond the widest radius and is in the total only"]


def gaussian_radial_profile(gaussians: GaussianSum) -> RadialProfile:
    """Return the radial profile of a sum of Gaussians."""
    radius, edges = radius_grid(), ring_edges()
    return RadialProfile(
        name=gaussians.name,
        model="table",
        radius_mm=radius,
        reflectance=gaussians.radiant_exitance(radius),
        total=gaussians.albedo,
        edges_mm=edges,
        ring_energy=np.diff(gaussians.energy_within(edges), axis=0),
    )
