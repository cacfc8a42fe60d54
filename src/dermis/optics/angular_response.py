"""Directions in a scattering medium: tables over the cosine, and light by direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
STEPS = 64
"""Between tables at 0 and at 1."""
ROWS = 32
"""Of the table over directions."""
_NODES = 32
_MOST_ALBEDO = 1.0 - 1e-8
KEPT = 256
"""Shares of light, or albedos, whose numbers are remembered."""


def interpolated(made: Callable[[float], Floats], at: float) -> Floats:
    """The table at a number in 0..1.

    made : the same at a multiple of 1 / STEPS; to be remembered by the caller
    """
    place = min(max(at, 0.0), 1.0) * STEPS
    low = min(int(place), STEPS - 1)
    share = place - low
    return np.asarray((1.0 - share) * made(low / STEPS) + share * made((low + 1) / STEPS))


@dataclass(frozen=True)
class Directions:
    """How a half-space differs from a diffuse surface, for each of c channels.

    Of light from a direction, `returned` times the profile's share comes back. It leaves evenly in all
    directions, except for light that scattered only once: `once` times (1/(a + b) - its mean over exit
    directions), with a and b the cosines of both directions below the surface.

    eta : index of refraction against the air [-]
    returned : (ROWS, c) by evenly spaced roots of the cosine, 1 from straight above [-]
    from_everywhere : (c,) the same for uniform light from all directions [-]
    once : (c,) [-]
    mean_once : mean of 1/(a + b) over both directions [-]
    """

    eta: float
    returned: Floats
    from_everywhere: Floats
    once: Floats
    mean_once: float


def directions(total: ArrayLike, eta: float) -> Directions:
    """The directions of half-spaces that return given shares of the light that enters perpendicularly.

    total : (c,) [-]
    eta : index of refraction against the air, at least 1 [-]

    Sources: [Chandrasekhar1960] for the half-space, which scatters isotropically; [Jensen2001] for taking
    single scattering apart.
    """
    shares = np.atleast_1d(np.asarray(total, np.float64))
    found = np.stack([interpolated(partial(_numbers, eta), float(one)) for one in shares], axis=-1)
    return Directions(eta, found[:ROWS], found[ROWS], found[ROWS + 1], _mean_once(eta))


def h_function(cosine: ArrayLike, albedo: float) -> Floats:
    """Chandrasekhar's H at cosines from the normal, of their shape [-].

    Source: [Chandrasekhar1960] section 39, the integral over the imaginary axis.
    """
    root, weight = gaussian_nodes(0.0, 1.0)
    angle = 0.5 * np.pi * root**2  # the integrand's logarithm is smooth in its root
    slope = np.pi * root * weight * np.log1p(-albedo * angle / np.tan(angle))
    mu = np.asarray(cosine, np.float64)[..., None]
    integral = (slope * mu / (np.cos(angle) ** 2 + (mu * np.sin(angle)) ** 2)).sum(axis=-1)
    return np.asarray(np.exp(-integral / np.pi))


def directional_albedo(cosine: ArrayLike, albedo: float, eta: float) -> Floats:
    """Share of light that leaves again, by the cosine of its direction in the air [-]."""
    return _Matched(albedo, eta).returned(refracted(cosine, eta))


def mean_of_once(cosine: ArrayLike, eta: float) -> Floats:
    """Mean of 1/(a + b) over exit directions, by the cosine of entry [-]."""
    a, critical = np.maximum(refracted(cosine, eta), 1e-4), critical_cosine(eta)
    return np.asarray(2.0 * eta**2 * (1.0 - critical - a * np.log((a + 1.0) / (a + critical))))


def refracted(cosine: ArrayLike, eta: float) -> Floats:
    """Cosine below the surface [-]."""
    return np.asarray(np.sqrt(1.0 - (1.0 - np.asarray(cosine, np.float64) ** 2) / eta**2))


class _Matched:
    """An index-matched half-space, and a smooth surface above it that reflects light back into it.

    Inside, R reflects light and the surface returns r of it: R + R r R + ... is solved for at once.
    """

    def __init__(self, albedo: float, eta: float) -> None:
        critical = critical_cosine(eta)
        escaping, caught = gaussian_nodes(critical, 1.0), gaussian_nodes(0.0, critical)
        self._mu, weight = (np.concatenate(both) for both in zip(escaping, caught, strict=True))
        self._albedo, self._H = albedo, h_function(self._mu, albedo)
        back = internal_reflectance(self._mu, eta)
        flux = 2.0 * weight * self._mu
        self.leaving = flux * (1.0 - back)
        self._within = np.eye(len(self._mu)) - self._reflected(self._mu, self._H) * flux * back

    def _reflected(self, mu: Floats, H: Floats) -> Floats:
        """(nodes, n) radiance over pi by nodes, for light from cosines."""
        return 0.25 * self._albedo * np.outer(self._H, H) / np.maximum(self._mu[:, None] + mu, 1e-12)

    def returned(self, inside: ArrayLike) -> Floats:
        """Share of the light from cosines below the surface that leaves."""
        mu = np.atleast_1d(np.asarray(inside, np.float64))
        source = self._reflected(mu, h_function(mu, self._albedo))
        leaving = self.leaving @ np.linalg.solve(self._within, source)
        return np.asarray(leaving.reshape(np.shape(inside)))

    def from_everywhere(self) -> float:
        """Share of uniform light that leaves again."""
        return float((self.leaving * self.returned(self._mu)).sum() / self.leaving.sum())


@lru_cache(maxsize=KEPT)
def _numbers(eta: float, total: float) -> Floats:
    """(ROWS + 2,) what is returned, the same from everywhere, and the strength of what scattered once."""
    albedo = albedo_returning(total, eta)
    space = _Matched(albedo, eta)
    above = float(space.returned(1.0))
    if above <= 0.0:
        return np.append(np.ones(ROWS + 1), 0.0)
    table = space.returned(refracted(np.linspace(0.0, 1.0, ROWS) ** 2, eta))
    once = 0.25 * albedo * float(space.leaving.sum())
    return np.concatenate([table, [space.from_everywhere(), once]]) / above


@lru_cache(maxsize=KEPT)
def _mean_once(eta: float) -> float:
    """Mean of 1/(a + b) over both directions."""
    mu, weight = gaussian_nodes(0.0, 1.0)
    return float((2.0 * weight * mu * mean_of_once(mu, eta)).sum())


def albedo_returning(total: float, eta: float) -> float:
    """Single-scattering albedo of the half-space that returns this share of what enters from above."""
    from scipy.optimize import brentq

    def beyond(albedo: float) -> float:
        return float(_Matched(albedo, eta).returned(1.0)) - total

    least = 1e-6
    if total <= 0.0 or beyond(least) >= 0.0:
        return least
    return float(brentq(beyond, least, _MOST_ALBEDO)) if beyond(_MOST_ALBEDO) > 0.0 else _MOST_ALBEDO


def internal_reflectance(cosine: Floats, eta: float) -> Floats:
    """Share of unpolarised light from inside that the surface reflects back."""
    outside = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - cosine**2), 0.0))
    across = (eta * cosine - outside) / np.maximum(eta * cosine + outside, 1e-12)
    along = (cosine - eta * outside) / np.maximum(cosine + eta * outside, 1e-12)
    return np.asarray(0.5 * (across**2 + along**2))


def critical_cosine(eta: float) -> float:
    """Least cosine below the surface at which light leaves."""
    return float(np.sqrt(1.0 - 1.0 / eta**2))


def gaussian_nodes(low: float, high: float, count: int = _NODES) -> tuple[Floats, Floats]:
    """Gaussian nodes and weights of an interval."""
    nodes, weights = _gaussian(count)
    return low + 0.5 * (high - low) * (nodes + 1.0), 0.5 * (high - low) * weights


@lru_cache(maxsize=4)
def _gaussian(count: int) -> tuple[Floats, Floats]:
    return np.polynomial.legendre.leggauss(count)
