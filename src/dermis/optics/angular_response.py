"""Reflectance of scattering half-spaces by the directions of incident and emerging light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
TABLE_STEPS = 64
"""Intervals from 0 to 1 between which tables are interpolated."""
DIRECTION_ROWS = 32
"""Rows of tables over directions."""
_NODES = 32
_MAX_ALBEDO = 1.0 - 1e-8
CACHE_SIZE = 256
"""Columns of tables that are kept in memory."""


def interpolate_table(column: Callable[[float], Floats], position: float) -> Floats:
    """Return a table column at a position in [0, 1] by linear interpolation between cached columns.

    column : function that returns the column at a multiple of 1 / TABLE_STEPS; it should be cached
    """
    scaled = min(max(position, 0.0), 1.0) * TABLE_STEPS
    low = min(int(scaled), TABLE_STEPS - 1)
    weight = scaled - low
    return np.asarray((1.0 - weight) * column(low / TABLE_STEPS) + weight * column((low + 1) / TABLE_STEPS))


def interpolate_columns(column: Callable[[float], Floats], positions: ArrayLike) -> Floats:
    """Return `interpolate_table` at positions (c,), with the columns in the last axis."""
    values = np.atleast_1d(np.asarray(positions, np.float64)).tolist()
    return np.stack([interpolate_table(column, value) for value in values], axis=-1)


@dataclass(frozen=True)
class AngularResponse:
    """Angular dependence of the reflectance of a half-space, relative to a diffuse surface.

    Light from a direction returns `relative_reflectance` times the total of the profile. It emerges uniformly
    in all directions, except for light that scattered once, which adds `single_scattering` times (1/(a + b)
    minus its mean over exit directions), with the cosines a and b of both directions below the surface.

    eta : index of refraction relative to air [-]
    relative_reflectance : (DIRECTION_ROWS, c) by evenly spaced square roots of the incident cosine; 1 at
        normal incidence [-]
    relative_diffuse_reflectance : (c,) for uniform light from all directions [-]
    single_scattering : (c,) strength of the single-scattering term [-]
    mean_kernel : mean of 1/(a + b) over both directions [-]
    """

    eta: float
    relative_reflectance: Floats
    relative_diffuse_reflectance: Floats
    single_scattering: Floats
    mean_kernel: float


def angular_response(total: ArrayLike, eta: float) -> AngularResponse:
    """Return the angular response of half-spaces with given reflectances at normal incidence.

    total : (c,) reflectance of light that enters perpendicularly [-]
    eta : index of refraction relative to air, at least 1 [-]

    Sources: [Chandrasekhar1960] for the half-space, which scatters isotropically; [Jensen2001] for the
    separation of single scattering.
    """
    columns = interpolate_columns(partial(_response_column, eta), total)
    table, (diffuse, single_scattering) = columns[:DIRECTION_ROWS], columns[DIRECTION_ROWS:]
    return AngularResponse(eta, table, diffuse, single_scattering, _mean_kernel(eta))


def h_function(cosine: ArrayLike, albedo: float) -> Floats:
    """Return Chandrasekhar's H function at cosines from the normal, in their shape [-].

    Source: [Chandrasekhar1960] section 39, the integral over the imaginary axis.
    """
    root, weight = gauss_legendre(0.0, 1.0)
    angle = 0.5 * np.pi * root**2  # substituted because the integrand's logarithm is smooth in its root
    slope = np.pi * root * weight * np.log1p(-albedo * angle / np.tan(angle))
    mu = np.asarray(cosine, np.float64)[..., None]
    integral = (slope * mu / (np.cos(angle) ** 2 + (mu * np.sin(angle)) ** 2)).sum(axis=-1)
    return np.asarray(np.exp(-integral / np.pi))


def directional_reflectance(cosine: ArrayLike, albedo: float, eta: float) -> Floats:
    """Return the reflectance of a half-space by the cosine of the incident direction in air [-]."""
    return _HalfSpace(albedo, eta).reflectance(refracted_cosine(cosine, eta))


def mean_single_scattering_kernel(cosine: ArrayLike, eta: float) -> Floats:
    """Return the mean of 1/(a + b) over exit directions b, by the incident cosine in air [-]."""
    a, critical = np.maximum(refracted_cosine(cosine, eta), 1e-4), critical_cosine(eta)
    return np.asarray(2.0 * eta**2 * (1.0 - critical - a * np.log((a + 1.0) / (a + critical))))


def refracted_cosine(cosine: ArrayLike, eta: float) -> Floats:
    """Return the cosine below the surface of light with a given cosine in air [-]."""
    return np.asarray(np.sqrt(1.0 - (1.0 - np.asarray(cosine, np.float64) ** 2) / eta**2))


class _HalfSpace:
    """Isotropically scattering half-space below a smooth surface, discretised by direction.

    Light is reflected back and forth between medium R and surface r: the series R + R r R + ... is solved
    directly.
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

    def _reflected_radiance(self, mu: Floats, H: Floats) -> Floats:
        """Return radiance over pi at the nodes, (nodes, n), for light from n cosines."""
        return 0.25 * self._albedo * np.outer(self._H, H) / np.maximum(self._mu[:, None] + mu, 1e-12)

    def reflectance(self, cosine: ArrayLike) -> Floats:
        """Return the fraction of light from cosines below the surface that leaves the medium."""
        mu = np.atleast_1d(np.asarray(cosine, np.float64))
        source = self._reflected_radiance(mu, h_function(mu, self._albedo))
        leaving = self.leaving @ np.linalg.solve(self._transport, source)
        return np.asarray(leaving.reshape(np.shape(cosine)))

    def diffuse_reflectance(self) -> float:
        """Return the fraction of uniform light that leaves the medium again."""
        return float((self.leaving * self.reflectance(self._mu)).sum() / self.leaving.sum())


@lru_cache(maxsize=CACHE_SIZE)
def _response_column(eta: float, total: float) -> Floats:
    """Return relative and relative diffuse reflectance and single scattering, (DIRECTION_ROWS + 2,)."""
    albedo = albedo_for_reflectance(total, eta)
    space = _HalfSpace(albedo, eta)
    normal = float(space.reflectance(1.0))
    if normal <= 0.0:
        return np.append(np.ones(DIRECTION_ROWS + 1), 0.0)
    table = space.reflectance(refracted_cosine(np.linspace(0.0, 1.0, DIRECTION_ROWS) ** 2, eta))
    single_scattering = 0.25 * albedo * float(space.leaving.sum())
    return np.concatenate([table, [space.diffuse_reflectance(), single_scattering]]) / normal


@lru_cache(maxsize=CACHE_SIZE)
def _mean_kernel(eta: float) -> float:
    """Return the mean of 1/(a + b) over both directions."""
    mu, weight = gauss_legendre(0.0, 1.0)
    return float((2.0 * weight * mu * mean_single_scattering_kernel(mu, eta)).sum())


def albedo_for_reflectance(total: float, eta: float) -> float:
    """Return the single-scattering albedo of the half-space with a given reflectance at normal incidence."""
    from scipy.optimize import brentq

    def excess(albedo: float) -> float:
        return float(_HalfSpace(albedo, eta).reflectance(1.0)) - total

    min_albedo = 1e-6
    if total <= 0.0 or excess(min_albedo) >= 0.0:
        return min_albedo
    return float(brentq(excess, min_albedo, _MAX_ALBEDO)) if excess(_MAX_ALBEDO) > 0.0 else _MAX_ALBEDO


def internal_reflectance(cosine: Floats, eta: float) -> Floats:
    """Return the Fresnel reflectance of the surface for unpolarised light from inside [-]."""
    outside = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - cosine**2), 0.0))
    across = (eta * cosine - outside) / np.maximum(eta * cosine + outside, 1e-12)
    along = (cosine - eta * outside) / np.maximum(cosine + eta * outside, 1e-12)
    return np.asarray(0.5 * (across**2 + along**2))


def critical_cosine(eta: float) -> float:
    """Return the cosine of the critical angle of total internal reflection."""
    return float(np.sqrt(1.0 - 1.0 / eta**2))


def gauss_legendre(low: float, high: float, count: int = _NODES) -> tuple[Floats, Floats]:
    """Return nodes and weights of Gauss-Legendre quadrature on an interval."""
    nodes, weights = _unit_gauss_legendre(count)
    return low + 0.5 * (high - low) * (nodes + 1.0), 0.5 * (high - low) * weights


@lru_cache(maxsize=4)
def _unit_gauss_legendre(count: int) -> tuple[Floats, Floats]:
    return np.polynomial.legendre.leggauss(count)
