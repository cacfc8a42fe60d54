"""A radial profile in numbers: R(r) at radii, and the light that leaves through rings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.optics.fits.targets import Points, Rings
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Floats

NOTABLE_SHARE, TINY = 0.01, float(np.finfo(np.float64).tiny)
NARROWEST_MM, WIDEST_MM = 1e-4, 60.0
"""The radii that a profile covers and an error is integrated over [mm]."""


@dataclass(frozen=True)
class RadialProfile:
    """How light that enters at a point leaves around it, in c channels.

    name : of the medium
    model : how it was computed
    radius_mm : (n,) increasing [mm]
    reflectance : (n, c) R(r) [1/mm2]
    total : (c,) integral of 2 pi r R(r) [-]
    edges_mm : (k + 1,) of rings, the first at 0 [mm]
    ring_energy : (k, c) light that leaves through each ring [-]
    standard_error : (n, c) of R(r) where it was counted, else None [1/mm2]
    total_error : (c,) of the total, likewise [-]
    incident : whether per power that arrives (surface reflection excluded) or that enters
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
    def finite(self) -> bool:
        """Whether R(r) has a value at the point of entry: a beam's does not."""
        return self.model not in ("layered", "montecarlo", "counted")

    def points(self) -> Points:
        """What a fit of R(r) itself is judged by."""
        return Points(self.radius_mm, self.reflectance, self.total)

    def rings(self) -> Rings:
        """What any fit is judged by, whatever R(r) does at its centre."""
        return Rings(self.edges_mm, self.ring_energy, self.total)


def ring_edges(rings: int = 120) -> Floats:
    """Edges of a disc and log-spaced rings around it, (rings + 1,) [mm]."""
    return np.concatenate([[0.0], np.geomspace(1e-3, WIDEST_MM, rings)])


def radius_grid(count: int = 600) -> Floats:
    """Log-spaced radii, (count,) [mm]."""
    return np.geomspace(NARROWEST_MM, WIDEST_MM, count)


def resample(radius_mm: Floats, grid_mm: Floats, values: Floats) -> Floats:
    """Values (m, c) on a log-spaced grid, read at other radii with a cubic spline in log r, (n, c)."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(np.log(grid_mm), values)(np.log(radius_mm)))


def enclosed(radius_mm: Floats, grid_mm: Floats, reflectance: Floats) -> Floats:
    """Light that leaves within each radius, (n, c), of R(r) on a log-spaced grid that starts near 0 [-]."""
    from scipy.integrate import cumulative_simpson

    rate = 2.0 * np.pi * grid_mm[:, None] ** 2 * reflectance  # per unit of log r
    inner = 0.5 * rate[:1]  # R is about constant within the grid's first radius
    within = inner + cumulative_simpson(rate, x=np.log(grid_mm), axis=0, initial=0.0)
    return np.where(
        radius_mm[:, None] > 0.0, resample(np.maximum(radius_mm, grid_mm[0]), grid_mm, within), 0.0
    )


def light_beyond(total: Floats, ring_energy: Floats) -> list[str]:
    """A warning when rings (k, c) lack a notable share of the total (c,), else nothing."""
    share = float(((total - ring_energy.sum(axis=0)) / np.maximum(np.abs(total), TINY)).max())
    if share < NOTABLE_SHARE:
        return []
    return [f"{share:.0%} of the light leaves beyond the widest radius and is in the total only"]


def profile_of_table(table: GaussianSum) -> RadialProfile:
    """The radial profile that a sum of Gaussians itself is."""
    radius, edges = radius_grid(), ring_edges()
    return RadialProfile(
        name=table.name,
        model="table",
        radius_mm=radius,
        reflectance=table.radiant_exitance(radius),
        total=table.albedo,
        edges_mm=edges,
        ring_energy=np.diff(table.within(edges), axis=0),
    )
