"""Reflectance of scattering half-spaces as a function of the directions of incident and emerging light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.base.disk import cached_array

Floats = NDArray[np.float64]
INTERPOLATION_STEPS = 64
"""Number of equal intervals between the columns of a table, whose positions range from 0 to 1."""
DIRECTION_ROWS = 32
"""Number of incident directions in tables; the square roots of their cosines are evenly spaced."""
_QUADRATURE_NODES = 32
_MAX_SINGLE_SCATTERING_ALBEDO = 1.0 - 1e-8
_CACHE_VERSION = "angular response 1"
CACHED_COLUMN_COUNT = 256
"""Number of table columns that each function caches."""


def interpolate_table(column_at: Callable[[float], Floats], table_position: float) -> Floats:
    """Return the column of a table at a position, interpolated linearly between the two nearest columns.

    The positions of the table's columns are the multiples of 1 / INTERPOLATION_STEPS from 0 to 1.

    column_at : function that computes the column at a position, as an array; it should cache its results
    table_position : position between 0 and 1; values outside this range are clamped
    """
    scaled = min(max(table_position, 0.0), 1.0) * INTERPOLATION_STEPS
    low = min(int(scaled), INTERPOLATION_STEPS - 1)
    weight = scaled - low
    return np.asarray(
        (1.0 - weight) * column_at(low / INTERPOLATION_STEPS)
        + weight * column_at((low + 1) / INTERPOLATION_STEPS)
    )


def interpolate_columns(column_at: Callable[[float], Floats], table_positions: ArrayLike) -> Floats:
    """Return the columns of a table at c positions, interpolated as in `interpolate_table`.

    The columns are stacked along the last axis of the result.

    column_at : function that returns the column at a position, see `interpolate_table`
    table_positions : (c,) positions between 0 and 1
    """
    values = np.atleast_1d(np.asarray(table_positions, np.float64)).tolist()
    return np.stack([interpolate_table(column_at, value) for value in values], axis=-1)


@dataclass(frozen=True)
class AngularResponse:
    """Factors that describe how the reflectance of a half-space depends on direction.

    For each pair of an incident and an exit direction, subsurface light is multiplied by the sum of two
    terms. Both terms are relative to the reflectance at normal incidence. The first term,
    `relative_reflectance`, is the reflectance for the incident direction. The second term, for light that
    scattered once, is `single_scattering` times the difference between the kernel 1/(a + b) and the mean of
    this kernel over exit directions. Here, a and b are the cosines of the incident and the exit direction
    below the surface.

    eta : index of refraction relative to air [-]
    relative_reflectance : (DIRECTION_ROWS, c) reflectance relative to normal incidence, at incident cosines
        in air whose square roots are evenly spaced from 0 to 1 [-]
    relative_diffuse_reflectance : (c,) reflectance for uniform light relative to normal incidence [-]
    single_scattering : (c,) factor of the single-scattering kernel [-]
    mean_kernel : mean of 1/(a + b) over incident and exit directions [-]
    """

    eta: float
    relative_reflectance: Floats
    relative_diffuse_reflectance: Floats
    single_scattering: Floats
    mean_kernel: float


def angular_response(total_reflectance: ArrayLike, eta: float) -> AngularResponse:
    """Return the angular response of isotropically scattering half-spaces with given reflectances.

    total_reflectance : (c,) reflectance of the half-space in each channel for light at normal incidence [-]
    eta : index of refraction relative to air, at least 1 [-]

    Sources: [Chandrasekhar1960] for the half-space; [Jensen2001] for the separation of single scattering.
    """
    columns = interpolate_columns(partial(_angular_response_column, eta), total_reflectance)
    table, (diffuse, single_scattering) = columns[:DIRECTION_ROWS], columns[DIRECTION_ROWS:]
    return AngularResponse(eta, table, diffuse, single_scattering, _mean_kernel(eta))


def h_function(cosine: ArrayLike, albedo: float) -> Floats:
    """Return Chandrasekhar's H function of a half-space [-].

    cosine : cosines of angles to the normal
    albedo : single-scattering albedo [-]

    Source: [Chandrasekhar1960] section 39, the integral over the imaginary axis.
    """
    root, weight = gauss_legendre(0.0, 1.0)
    angle = 0.5 * np.pi * root**2  # substituted because the integrand's logarithm is smooth in its root
    slope = np.pi * root * weight * np.log1p(-albedo * angle / np.tan(angle))
    mu = np.asarray(cosine, np.float64)[..., None]
    integral = (slope * mu / (np.cos(angle) ** 2 + (mu * np.sin(angle)) ** 2)).sum(axis=-1)
    return np.asarray(np.exp(-integral / np.pi))


def directional_reflectance(cosine: ArrayLike, albedo: float, eta: float) -> Floats:
    """Return the reflectance of a half-space for given directions of incident light [-].

    cosine : cosine of the angle of incidence in air
    albedo : single-scattering albedo of the half-space [-]
    eta : index of refraction relative to air [-]
    """
    return _HalfSpace(albedo, eta).reflectance(refracted_cosine(cosine, eta))


def mean_single_scattering_kernel(cosine: ArrayLike, eta: float) -> Floats:
    """Return the mean of 1/(a + b) over exit directions, weighted by their cosines in air [-].

    Here, a and b are the cosines of the incident and the exit direction below the surface.

    cosine : cosine of the angle of incidence in air
    eta : index of refraction relative to air [-]
    """
    a, critical = np.maximum(refracted_cosine(cosine, eta), 1e-4), critical_cosine(eta)
    return np.asarray(2.0 * eta**2 * (1.0 - critical - a * np.log((a + 1.0) / (a + critical))))


def refracted_cosine(cosine: ArrayLike, eta: float) -> Floats:
    """Return the cosine of the angle of refraction below the surface.

    cosine : cosine of the angle of incidence in air
    eta : index of refraction relative to air [-]
    """
    return np.asarray(np.sqrt(1.0 - (1.0 - np.asarray(cosine, np.float64) ** 2) / eta**2))


class _HalfSpace:
    """Isotropically scattering half-space below a smooth surface, for a set of discrete directions.

    The operator R describes reflection by the medium. The operator r describes internal reflection by the
    surface. The series R + R r R + ... of multiple reflections is summed by solving one linear system.
    """

    def __init__(self, albedo: float, eta: float) -> None:
        critical = critical_cosine(eta)
        escaping, reflected = gauss_legendre(critical, 1.0), gauss_legendre(0.0, critical)
        self._mu, weight = (np.concatenate(both) for both in zip(escaping, reflected, strict=True))
        self._albedo, self._H = albedo, h_function(self._mu, albedo)
        internal = internal_reflectance(self._mu, eta)
        flux = 2.0 * weight * self._mu
        self.leaving = flux * (1.0 - internal)
        self._transport = (
            np.eye(len(self._mu)) - self._reflected_radiance(self._mu, self._H) * flux * internal
        )

    def _reflected_radiance(self, incident_cosine: Floats, h_values: Floats) -> Floats:
        """Return pi times the radiance that the medium reflects into each of the discrete directions [-].

        The light from each incident direction has the irradiance 1 on the medium. The result (d, n) has a row
        for each discrete direction and a column for each incident direction.

        incident_cosine : (n,) cosines of the directions of incident light below the surface
        h_values : (n,) H function at these cosines
        """
        return (
            0.25
            * self._albedo
            * np.outer(self._H, h_values)
            / np.maximum(self._mu[:, None] + incident_cosine, 1e-12)
        )

    def reflectance(self, cosine: ArrayLike) -> Floats:
        """Return the fraction of the entering light that leaves again, for given directions [-].

        cosine : cosines of the angles between the entering light and the normal, below the surface
        """
        mu = np.atleast_1d(np.asarray(cosine, np.float64))
        source = self._reflected_radiance(mu, h_function(mu, self._albedo))
        leaving = self.leaving @ np.linalg.solve(self._transport, source)
        return np.asarray(leaving.reshape(np.shape(cosine)))

    def diffuse_reflectance(self) -> float:
        """Return the fraction of the entering light that leaves again, under a uniform sky [-]."""
        return float((self.leaving * self.reflectance(self._mu)).sum() / self.leaving.sum())


@lru_cache(maxsize=CACHED_COLUMN_COUNT)
def _angular_response_column(eta: float, total_reflectance: float) -> Floats:
    """Return fields of `AngularResponse` for one channel, as one column (DIRECTION_ROWS + 2,) of a table.

    The first DIRECTION_ROWS elements are `relative_reflectance`; the last two are
    `relative_diffuse_reflectance` and `single_scattering`.

    Columns are cached on disk, because their computation and its imports take a second of a new process.

    eta : index of refraction relative to air [-]
    total_reflectance : reflectance of the half-space for light at normal incidence [-]
    """
    inputs = np.array([eta, total_reflectance])
    return cached_array(inputs, _CACHE_VERSION, partial(_compute_column, eta, total_reflectance))


def _compute_column(eta: float, total_reflectance: float) -> Floats:
    albedo = albedo_for_reflectance(total_reflectance, eta)
    space = _HalfSpace(albedo, eta)
    normal = float(space.reflectance(1.0))
    if normal <= 0.0:
        return np.append(np.ones(DIRECTION_ROWS + 1), 0.0)
    table = space.reflectance(refracted_cosine(np.linspace(0.0, 1.0, DIRECTION_ROWS) ** 2, eta))
    single_scattering = 0.25 * albedo * float(space.leaving.sum())
    return np.concatenate([table, [space.diffuse_reflectance(), single_scattering]]) / normal


@lru_cache(maxsize=CACHED_COLUMN_COUNT)
def _mean_kernel(eta: float) -> float:
    """Return the mean of 1/(a + b) over all pairs of an incident and an exit direction [-].

    Here, a and b are the cosines of the two directions below the surface. Each direction is weighted by its
    cosine in air, as for light from a uniform sky.

    eta : index of refraction relative to air [-]
    """
    mu, weight = gauss_legendre(0.0, 1.0)
    return float((2.0 * weight * mu * mean_single_scattering_kernel(mu, eta)).sum())


def albedo_for_reflectance(total_reflectance: float, eta: float) -> float:
    """Return the single-scattering albedo of the half-space that has a given reflectance [-].

    The exact reflectance of an isotropically scattering half-space is inverted numerically.

    total_reflectance : reflectance for light at normal incidence [-]
    eta : index of refraction relative to air [-]
    """
    from scipy.optimize import brentq

    def reflectance_excess(albedo: float) -> float:
        return float(_HalfSpace(albedo, eta).reflectance(1.0)) - total_reflectance

    min_albedo = 1e-6
    if total_reflectance <= 0.0 or reflectance_excess(min_albedo) >= 0.0:
        return min_albedo
    return (
        float(brentq(reflectance_excess, min_albedo, _MAX_SINGLE_SCATTERING_ALBEDO))
        if reflectance_excess(_MAX_SINGLE_SCATTERING_ALBEDO) > 0.0
        else _MAX_SINGLE_SCATTERING_ALBEDO
    )


def internal_reflectance(cosine: Floats, eta: float) -> Floats:
    """Return the Fresnel reflectance of the surface for unpolarised light from below [-].

    cosine : cosines of angles to the normal below the surface
    eta : index of refraction relative to air [-]
    """
    outside = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - cosine**2), 0.0))
    across = (eta * cosine - outside) / np.maximum(eta * cosine + outside, 1e-12)
    along = (cosine - eta * outside) / np.maximum(cosine + eta * outside, 1e-12)
    return np.asarray(0.5 * (across**2 + along**2))


def critical_cosine(eta: float) -> float:
    """Return the cosine of the critical angle, at which total internal reflection begins [-]."""
    return float(np.sqrt(1.0 - 1.0 / eta**2))


def gauss_legendre(
    lower_limit: float, upper_limit: float, node_count: int = _QUADRATURE_NODES
) -> tuple[Floats, Floats]:
    """Return nodes (node_count,) and weights (node_count,) of Gauss-Legendre quadrature in an interval."""
    nodes, weights = _unit_gauss_legendre(node_count)
    return lower_limit + 0.5 * (upper_limit - lower_limit) * (nodes + 1.0), 0.5 * (
        upper_limit - lower_limit
    ) * weights


@lru_cache(maxsize=4)
def _unit_gauss_legendre(node_count: int) -> tuple[Floats, Floats]:
    return np.polynomial.legendre.leggauss(node_count)
