"""Diffusion profiles as they are integrated: a fine table with bounds of its derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse

Floats = NDArray[np.float64]

TABLE_ROWS = 8192
"""Of the table, in even steps of the square root of the radius: linear interpolation errs by 5e-6."""

_GAUSSIAN_CUTOFF = 1e-12  # of a Gaussian's peak, where it ends
_FAR_ERROR_FRACTION = 0.2  # of the permitted error, spread over a slowly falling tail so that far nodes stay closed


@dataclass(frozen=True)
class GaussianSum:
    """Profile R(r) = sum of weight exp(-r² / 2v) / (2 pi v). The truth's own, apart from the models'.

    weight : (k, 3) energy of each Gaussian, by channel [-]
    variance_mm2 : (k,) v [mm²]
    """

    weight: Floats
    variance_mm2: Floats

    def __post_init__(self) -> None:
        weight, variance = np.asarray(self.weight), np.asarray(self.variance_mm2)
        if variance.ndim != 1 or weight.shape != (len(variance), 3) or not len(variance):
            came = f"{weight.shape} and {variance.shape} came"
            refuse("GaussianSum", "weights (k, 3) and variances (k,)", came, "Correct the arrays")
        if not (np.isfinite(weight).all() and np.isfinite(variance).all() and (variance > 0).all()):
            refuse("GaussianSum", "finite weights and variances above 0", "others came", "Correct them")

    @property
    def end_mm(self) -> float:
        """Radius beyond which the profile is 0 [mm]."""
        return float(np.sqrt(-2 * np.log(_GAUSSIAN_CUTOFF) * np.max(self.variance_mm2)))

    def derivatives(self, radius_mm: Floats) -> tuple[Floats, Floats, Floats]:
        """Return R, dR/dr and d²R/dr² at radii (n,), each (n, 3) [mm^-2, mm^-3, mm^-4]."""
        r, v = radius_mm[:, None], np.asarray(self.variance_mm2)
        gaussian = np.exp(-(r**2) / (2 * v)) / (2 * np.pi * v)
        weight = np.asarray(self.weight)
        return gaussian @ weight, (-r / v * gaussian) @ weight, ((r**2 / v - 1) / v * gaussian) @ weight


@dataclass(frozen=True)
class RadialTable:
    """Profile R(r) from a table: constant below the first radius, monotone cubics, 0 beyond the last.

    radius_mm : (n,) increasing, 0 or more [mm]
    reflectance : (n, 3) R [mm^-2]
    """

    radius_mm: Floats
    reflectance: Floats

    def __post_init__(self) -> None:
        r, R = np.asarray(self.radius_mm), np.asarray(self.reflectance)
        if r.ndim != 1 or len(r) < 4 or R.shape != (len(r), 3):
            came = f"{r.shape} and {R.shape} came"
            refuse("RadialTable", "at least 4 radii (n,) and R (n, 3)", came, "Correct the arrays")
        if not (np.isfinite(R).all() and np.isfinite(r).all() and r[0] >= 0 and (np.diff(r) > 0).all()):
            expected = "finite R and radii that increase from 0 or more"
            refuse("RadialTable", expected, "others came", "Correct them")

    @property
    def end_mm(self) -> float:
        """Radius beyond which the profile is 0 [mm]."""
        return float(self.radius_mm[-1])

    def derivatives(self, radius_mm: Floats) -> tuple[Floats, Floats, Floats]:
        """Return R, dR/dr and d²R/dr² at radii (n,), each (n, 3) [mm^-2, mm^-3, mm^-4]."""
        from scipy.interpolate import PchipInterpolator

        r, R = np.asarray(self.radius_mm, np.float64), np.asarray(self.reflectance, np.float64)
        if r[0] > 0:  # constant up to the first radius, or the slope would jump on the axis
            r, R = np.concatenate([[0.0], r]), np.vstack([R[:1], R])
        curve = PchipInterpolator(r, R, axis=0)
        value, slope, bend = (np.asarray(curve(radius_mm, order)) for order in range(3))
        return value, slope, bend


Profile = GaussianSum | RadialTable


class ProfileTable(NamedTuple):
    """A profile by the square root of the radius, `per_root` rows for 1 mm^(1/2).

    R : (rows, 3) profile [mm^-2], 0 in the last row
    slope : (rows,) bound of |dR/dr| from this radius on, over the profile's energy [mm^-3]
    curvature : (rows,) bound of half the largest second derivative, likewise [mm^-4]
    share : (rows,) density of the permitted error: falls, with integral 1 over a plane [mm^-2]
    """

    per_root: float
    R: Floats
    slope: Floats
    curvature: Floats
    share: Floats


def tabulate_profile(profile: Profile) -> ProfileTable:
    """Return the table of a profile.

    A patch of second moment m about its centre, replaced by a point there, errs by up to m times the
    curvature. The fewest patches for a given sum of such errors have m proportional to 1 / sqrt(curvature)
    (Lagrange), so the permitted error is shared out that way.
    """
    end = profile.end_mm
    root = np.linspace(0.0, np.sqrt(end), TABLE_ROWS)
    r = root**2
    # The second derivative across the radius is R'/r, which tends to R'' on the axis.
    off_axis = np.maximum(r, r[1])
    R, dR, ddR = profile.derivatives(off_axis)
    energy = _plane_integral(np.abs(R), r)
    lit = energy > 0
    if not lit.any():
        refuse("profile", "light in at least one channel", "it is 0 everywhere", "Correct it")
    slope = _upper_bound(np.abs(dR), energy, lit)
    bend = np.maximum(np.abs(ddR), np.abs(dR) / off_axis[:, None])
    curvature = _upper_bound(0.5 * bend, energy, lit)
    R[-1] = 0.0
    return ProfileTable((TABLE_ROWS - 1) / np.sqrt(end), np.ascontiguousarray(R), slope, curvature, _error_density(curvature, r))


def _upper_bound(values: Floats, energy: Floats, lit: NDArray[np.bool_]) -> Floats:
    """Return (rows,) the largest value of any channel from each radius on; 0 in the last row."""
    largest = np.max(values[:, lit] / energy[lit], axis=1)
    bound: Floats = np.maximum.accumulate(largest[::-1])[::-1].copy()
    bound[-1] = 0.0
    return bound


def _error_density(curvature: Floats, r: Floats) -> Floats:
    ideal = np.sqrt(curvature)
    ideal /= _plane_integral(ideal[:, None], r)[0]
    reach = r[-1] / 4
    far = 1 / (np.pi * reach**2 * (1 + (r / reach) ** 2) ** 2)
    share: Floats = (1 - _FAR_ERROR_FRACTION) * ideal + _FAR_ERROR_FRACTION * far
    return share


def _plane_integral(values: Floats, r: Floats) -> Floats:
    """Return the integral of 2 pi r values dr, for each column of values (rows, k)."""
    rings = np.pi * np.diff(r**2)[:, None]
    integral: Floats = (0.5 * (values[1:] + values[:-1]) * rings).sum(axis=0)
    return integral
