"""Diffusion profiles as dense tables with upper bounds of their derivatives, for surface integrals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse

Floats = NDArray[np.float64]

PROFILE_TABLE_ROWS = 8192
"""Rows evenly spaced in the square root of the radius; linear interpolation has an error of 5e-6."""

_RELATIVE_GAUSSIAN_CUTOFF = 1e-12  # relative to the peak of a Gaussian
_FAR_RADII_ERROR_FRACTION = 0.2
"""Fraction of the permitted error that is spread widely over the radii, so that distant nodes of the octree
need not be opened."""


@dataclass(frozen=True)
class GaussianSum:
    """Diffusion profile R(r), the sum of weight exp(-r² / 2v) / (2 pi v) over Gaussians.

    The renderer uses another class, so that the reference shares no code with the renderer.

    weight : (k, 3) energy of each Gaussian, by channel [-]
    variance_mm2 : (k,) variance v of each Gaussian [mm²]
    """

    weight: Floats
    variance_mm2: Floats

    @property
    def max_radius_mm(self) -> float:
        """Return the radius beyond which the profile is taken as 0 [mm]."""
        return float(np.sqrt(-2 * np.log(_RELATIVE_GAUSSIAN_CUTOFF) * np.max(self.variance_mm2)))

    def derivatives(self, radius_mm: Floats) -> tuple[Floats, Floats, Floats]:
        """Return R(r), dR/dr and d²R/dr², each (n, 3), at n radii [mm^-2, mm^-3, mm^-4]."""
        r, v = radius_mm[:, None], np.asarray(self.variance_mm2)
        gaussian = np.exp(-(r**2) / (2 * v)) / (2 * np.pi * v)
        weight = np.asarray(self.weight)
        return gaussian @ weight, (-r / v * gaussian) @ weight, ((r**2 / v - 1) / v * gaussian) @ weight


@dataclass(frozen=True)
class RadialTable:
    """Diffusion profile R(r) by monotone cubic interpolation of a table.

    The profile is constant below the first radius and 0 beyond the last.

    radius_mm : (n,) increasing radii, 0 or more [mm]
    reflectance : (n, 3) R(r) at these radii [mm^-2]
    """

    radius_mm: Floats
    reflectance: Floats

    @property
    def max_radius_mm(self) -> float:
        """Return the radius beyond which the profile is taken as 0 [mm]."""
        return float(self.radius_mm[-1])

    def derivatives(self, radius_mm: Floats) -> tuple[Floats, Floats, Floats]:
        """Return R(r), dR/dr and d²R/dr², each (n, 3), at n radii [mm^-2, mm^-3, mm^-4]."""
        from scipy.interpolate import PchipInterpolator

        r, R = np.asarray(self.radius_mm, np.float64), np.asarray(self.reflectance, np.float64)
        if r[0] > 0:  # constant up to the first radius, so that the slope is continuous on the axis
            r, R = np.concatenate([[0.0], r]), np.vstack([R[:1], R])
        curve = PchipInterpolator(r, R, axis=0)
        value, slope, bend = (np.asarray(curve(radius_mm, order)) for order in range(3))
        return value, slope, bend


Profile = GaussianSum | RadialTable


class ProfileTable(NamedTuple):
    """Diffusion profile R(r) in rows evenly spaced in the square root of r, with bounds of its derivatives.

    Each bound holds at the radius of its row and at all larger radii, for the profile of each channel divided
    by the channel's energy.

    rows_per_root : number of rows per unit of the square root of the radius [mm^(-1/2)]
    R : (rows, 3) profile, 0 in the last row [mm^-2]
    slope : (rows,) upper bound of |dR/dr| [mm^-3]
    curvature : (rows,) upper bound of half the second derivative in any direction [mm^-4]
    error_density : (rows,) fraction of the total permitted error that a unit of area at the row's radius may
        cause; it decreases with the radius, and its integral over the plane is 1 [mm^-2]
    """

    rows_per_root: float
    R: Floats
    slope: Floats
    curvature: Floats
    error_density: Floats


def tabulate_profile(profile: Profile) -> ProfileTable:
    """Return the table of a profile, with bounds of its derivatives and the permitted error at each radius.

    The error of a surface integral is a sum over surface patches. Most of the permitted error is distributed
    over the radii in proportion to the square root of the profile's second derivative. This distribution
    needs few patches for a given total error. The rest of the permitted error is spread widely, so that
    distant patches can be large.
    """
    max_radius_mm = profile.max_radius_mm
    root = np.linspace(0.0, np.sqrt(max_radius_mm), PROFILE_TABLE_ROWS)
    r = root**2
    # The tangential second derivative is R'/r, which tends to R'' on the axis.
    off_axis = np.maximum(r, r[1])
    R, dR, ddR = profile.derivatives(off_axis)
    energy = _plane_integral(np.abs(R), r)
    nonzero = energy > 0
    if not nonzero.any():
        refuse("profile", "light in at least one channel", "it is 0 everywhere", "Correct it")
    slope = _bound_beyond_radius(np.abs(dR), energy, nonzero)
    bend = np.maximum(np.abs(ddR), np.abs(dR) / off_axis[:, None])
    curvature = _bound_beyond_radius(0.5 * bend, energy, nonzero)
    R[-1] = 0.0
    return ProfileTable(
        (PROFILE_TABLE_ROWS - 1) / np.sqrt(max_radius_mm),
        np.ascontiguousarray(R),
        slope,
        curvature,
        _error_density(curvature, r),
    )


def _bound_beyond_radius(radial_values: Floats, energy: Floats, has_energy: NDArray[np.bool_]) -> Floats:
    """Return for each row the largest value (rows,) that any channel has in this row or in a later row.

    radial_values : (rows, 3) function of the radius by channel, in order of increasing radius
    energy : (3,) energy of the profile by channel; the values of each channel are divided by it
    has_energy : (3,) mask of channels with energy
    """
    largest = np.max(radial_values[:, has_energy] / energy[has_energy], axis=1)
    bound: Floats = np.maximum.accumulate(largest[::-1])[::-1].copy()
    bound[-1] = 0.0
    return bound


def _error_density(curvature: Floats, radius_mm: Floats) -> Floats:
    ideal = np.sqrt(curvature)
    ideal /= _plane_integral(ideal[:, None], radius_mm)[0]
    falloff_mm = radius_mm[-1] / 4
    far_density = 1 / (np.pi * falloff_mm**2 * (1 + (radius_mm / falloff_mm) ** 2) ** 2)
    return np.asarray((1 - _FAR_RADII_ERROR_FRACTION) * ideal + _FAR_RADII_ERROR_FRACTION * far_density)


def _plane_integral(radial_values: Floats, radius_mm: Floats) -> Floats:
    """Return the integrals (k,) over the plane of k radial functions f(r): integrals of 2 pi r f(r) dr.

    radial_values : (rows, k) values of k functions at the radii
    radius_mm : (rows,) radii r [mm]
    """
    rings = np.pi * np.diff(radius_mm**2)[:, None]
    return np.asarray((0.5 * (radial_values[1:] + radial_values[:-1]) * rings).sum(axis=0))
