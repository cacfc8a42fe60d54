"""Radial profiles as arrays: R(r) at radii, and the light that emerges through rings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.optics.fits.targets import PointTarget, RingTarget
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Floats

NOTABLE_MISSING_LIGHT_RATIO, SMALLEST_FLOAT = 0.01, float(np.finfo(np.float64).tiny)
MIN_RADIUS_MM, MAX_RADIUS_MM = 1e-4, 60.0
"""Smallest and largest radius of a sampled profile; errors are integrated between them [mm]."""


@dataclass(frozen=True)
class RadialProfile:
    """Diffusion profile sampled at radii and integrated over rings, in c channels.

    name : name of the medium
    model : name of the model that computed the profile
    radius_mm : (n,) radii r, increasing [mm]
    reflectance : (n, c) profile R(r) at these radii [1/mm2]
    total : (c,) total reflectance, the integral of 2 pi r R(r) [-]
    edges_mm : (k + 1,) radii of the ring edges, starting at 0 [mm]
    ring_energy : (k, c) light that emerges through each ring [-]
    standard_error : (n, c) standard error of R(r) from a Monte Carlo simulation, None if unknown [1/mm2]
    total_error : (c,) standard error of the total from a Monte Carlo simulation, None if unknown [-]
    incident : whether R(r) is relative to the incident power instead of the power that enters; in both cases,
        R(r) excludes surface reflection
    warnings : known inaccuracies of the profile, shown to the user
    sources : keys of the bibliography
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
        """Return whether R(r) is finite at r = 0; otherwise, fits must use the light through rings."""
        return self.model not in ("layered", "montecarlo", "counted")

    def point_target(self) -> PointTarget:
        """Return the samples of R(r) as the target of a fit."""
        return PointTarget(self.radius_mm, self.reflectance, self.total)

    def ring_target(self) -> RingTarget:
        """Return the light that emerges through each ring, as the target of a fit.

        The light through a ring is finite even if R(r) is infinite at r = 0.
        """
        return RingTarget(self.edges_mm, self.ring_energy, self.total)


def ring_edges(ring_count: int = 120) -> Floats:
    """Return the radii (ring_count + 1,) that bound a disc and the log-spaced rings around it [mm]."""
    return np.concatenate([[0.0], np.geomspace(1e-3, MAX_RADIUS_MM, ring_count)])


def radius_grid(radius_count: int = 600) -> Floats:
    """Return the log-spaced radii (radius_count,) at which profiles are sampled [mm]."""
    return np.geomspace(MIN_RADIUS_MM, MAX_RADIUS_MM, radius_count)


def resample_profile(radius_mm: Floats, grid_mm: Floats, grid_values: Floats) -> Floats:
    """Return values (n, c) at n radii, by cubic splines in log r through the values at a grid.

    radius_mm : (n,) radii [mm]
    grid_mm : (m,) log-spaced radii of the grid [mm]
    grid_values : (m, c) values at the radii of the grid
    """
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(np.log(grid_mm), grid_values)(np.log(radius_mm)))


def enclosed_energy(radius_mm: Floats, grid_mm: Floats, reflectance: Floats) -> Floats:
    """Return the light (n, c) that emerges within each of n radii, the integral of 2 pi r R(r) [-].

    radius_mm : (n,) radii [mm]
    grid_mm : (m,) log-spaced radii of the samples [mm]
    reflectance : (m, c) samples of R(r) [1/mm2]
    """
    from scipy.integrate import cumulative_simpson

    rate = 2.0 * np.pi * grid_mm[:, None] ** 2 * reflectance  # per unit of log r
    inner = 0.5 * rate[:1]  # R is nearly constant within the first radius of the grid
    within = inner + cumulative_simpson(rate, x=np.log(grid_mm), axis=0, initial=0.0)
    energy = resample_profile(np.maximum(radius_mm, grid_mm[0]), grid_mm, within)
    return np.where(radius_mm[:, None] > 0.0, energy, 0.0)


def missing_light_warnings(total_reflectance: Floats, ring_energy: Floats) -> list[str]:
    """Return a warning if at least 1 % of the total reflectance emerges outside the rings.

    total_reflectance : (c,) total reflectance [-]
    ring_energy : (k, c) light through each ring [-]
    """
    missing = float(
        (
            (total_reflectance - ring_energy.sum(axis=0))
            / np.maximum(np.abs(total_reflectance), SMALLEST_FLOAT)
        ).max()
    )
    if missing < NOTABLE_MISSING_LIGHT_RATIO:
        return []
    return [f"{missing:.0%} of the light leaves beyond the widest radius and is in the total only"]


def gaussian_radial_profile(gaussians: GaussianSum) -> RadialProfile:
    """Sample a sum of Gaussians as a radial profile, to compare it with profiles of other models."""
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
