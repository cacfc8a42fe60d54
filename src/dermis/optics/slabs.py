"""Slabs of anisotropically scattering media by adding and doubling."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.optics.angular_response import (
    CACHE_SIZE,
    DIRECTION_ROWS,
    AngularResponse,
    albedo_for_reflectance,
    angular_response,
    critical_cosine,
    gauss_legendre,
    internal_reflectance,
    interpolate_columns,
    mean_single_scattering_kernel,
    refracted_cosine,
)

Floats = NDArray[np.float64]
NODES = 16
"""Quadrature nodes of directions that leave a slab, and as many of directions that are totally reflected."""
DEEP_OPTICAL_DEPTH = 1e4
"""Thickness at which a slab equals a half-space [mean free paths]."""
_MIN_OPTICAL_DEPTH = 1e-6  # optical depth in which light scatters at most once
_EXTRAPOLATION_POINTS = 3  # cosines from which values beyond the last one are extrapolated
_MIN_REFLECTANCE = 1e-12


@dataclass(frozen=True, eq=False)
class PhaseMatrices:
    """Phase function of a medium averaged over azimuth, at discrete directions.

    The forward peak is treated as unscattered light, so that the scaled medium scatters less than the true
    one.

    albedo : single-scattering albedo of the scaled medium [-]
    extinction : extinction coefficient of the scaled medium over the reduced extinction [-]
    unscaled_extinction : the same of the true medium [-]
    backward, forward : (m, m) from cosines to cosines, into the opposite hemisphere and into the same; 1 for
        isotropic scattering [-]
    """

    albedo: float
    extinction: float
    unscaled_extinction: float
    backward: Floats
    forward: Floats


def phase_matrices(albedo: float, g: float, cosine: Floats, terms: int) -> PhaseMatrices:
    """Return the Henyey-Greenstein phase function expanded in Legendre polynomials.

    albedo : reduced [-]
    g : mean cosine, at least 0 and less than 1 [-]
    cosine : (m,) of the directions
    terms : of the series; the remainder is treated as unscattered

    Sources: [HenyeyGreenstein1941]; [Wiscombe1977] for the truncated forward peak.
    """
    unscaled = 1.0 + albedo * g / (1.0 - g)
    single, peak = albedo / ((1.0 - g) * unscaled), g**terms
    order = np.arange(terms)
    moment = (2.0 * order + 1.0) * (g**order - peak) / (1.0 - peak)
    P = np.polynomial.legendre.legvander(cosine, terms - 1)
    remaining = 1.0 - peak * single
    return PhaseMatrices(
        albedo=(1.0 - peak) * single / remaining,
        extinction=remaining * unscaled,
        unscaled_extinction=unscaled,
        backward=(P * moment * (-1.0) ** order) @ P.T,
        forward=(P * moment) @ P.T,
    )


@dataclass(frozen=True, eq=False)
class Slabs:
    """Reflected and transmitted power of slabs of n thicknesses for m incident directions.

    cosine : (m,) incident cosines below the surface, of directions that light from air has [-]
    flux : (m,) fraction of uniform light from air at each cosine; sums to 1
    reflected, transmitted : (n, m) fraction that scattered and leaves on the side of entry or on the far side
        [-]
    """

    cosine: Floats
    flux: Floats
    reflected: Floats
    transmitted: Floats


def solve_slabs(
    albedo: float, optical_depth: ArrayLike, eta: float, nodes: int = NODES, g: float = 0.0
) -> Slabs:
    """Compute slabs by adding and doubling; exact except for the discretisation of directions.

    albedo : of single scattering, reduced if scattering is anisotropic [-]
    optical_depth : (n,) thickness in (reduced) mean free paths, above 0 [-]
    eta : index of refraction relative to the air on both sides, at least 1 [-]
    nodes : as `NODES`
    g : mean cosine of scattering, at least 0 [-]

    Source: [Chandrasekhar1960] section 50 for the addition of layers.
    """
    tau = np.atleast_1d(np.asarray(optical_depth, np.float64))
    transport = _Transport.create(albedo, eta, nodes, g)
    doublings = transport.doublings(float(tau.max()))
    *_, (R, T, unscattered) = _doubling_steps(transport, tau / 2.0**doublings, doublings)
    return _slabs_in_air(transport, R, T, unscattered)


def solve_doubled_slabs(
    albedo: float, smallest_depth: ArrayLike, doublings: int, eta: float, nodes: int = NODES, g: float = 0.0
) -> Slabs:
    """Compute slabs of given depths and all their doublings, in the time of the thickest alone.

    smallest_depth : (n,) optical depths of similar size [-]
    doublings : number of doublings; the n (doublings + 1) slabs are ordered by doubling, then as
        `smallest_depth`
    """
    transport = _Transport.create(albedo, eta, nodes, g)
    before = transport.doublings(float(np.max(smallest_depth)))
    tau = np.asarray(smallest_depth, np.float64) / 2.0**before
    steps = list(_doubling_steps(transport, tau, before + doublings))[before:]
    R, T, unscattered = (np.concatenate(part) for part in zip(*steps, strict=True))
    return _slabs_in_air(transport, R, T, unscattered)


def half_space_radiance(albedo: float, eta: float, nodes: int, g: float) -> tuple[Floats, Floats, Floats]:
    """Return cosines, fractions of uniform light and emerging radiance of a half-space by directions.

    Cosines (m,) are below the surface. Fractions (m,) are those of uniform light that enters at each cosine.
    Radiance (m, m) is by exit direction, then entry direction, per light that enters: its mean weighted by
    the fractions is the reflectance.
    """
    transport = _Transport.create(albedo, eta, nodes, g)
    doublings = transport.doublings(DEEP_OPTICAL_DEPTH)
    tau = np.array([DEEP_OPTICAL_DEPTH / 2.0**doublings])
    *_, (R, T, unscattered) = _doubling_steps(transport, tau, doublings)
    reflected, _ = _add_faces(R * transport.flux, T * transport.flux, unscattered, transport.internal, R, T)
    leaving = (transport.flux * (1.0 - transport.internal))[transport.escapes]
    radiance = reflected[0][np.ix_(transport.escapes, transport.escapes)] * leaving.sum()
    return transport.mu[transport.escapes], leaving / leaving.sum(), radiance


@dataclass(frozen=True, eq=False)
class _Transport:
    """Discrete directions in a medium, with their internal reflection and scattering.

    mu, flux : (m,) cosines, and fractions of uniform light inside
    internal : (m,) reflectance of the faces from inside
    escapes : (m,) whether light at this cosine leaves through a face
    phase : how the medium scatters
    """

    mu: Floats
    flux: Floats
    internal: Floats
    escapes: NDArray[np.bool_]
    phase: PhaseMatrices

    @classmethod
    def create(cls, albedo: float, eta: float, nodes: int, g: float) -> _Transport:
        mu, weight = _quadrature(eta, nodes)
        internal, escapes = internal_reflectance(mu, eta), mu > critical_cosine(eta)
        return cls(mu, 2.0 * weight * mu, internal, escapes, phase_matrices(albedo, g, mu, nodes))

    def doublings(self, depth: float) -> int:
        """Return how often a slab in which light scatters at most once must be doubled to reach a depth."""
        return int(np.ceil(np.log2(max(depth * self.phase.extinction / _MIN_OPTICAL_DEPTH, 1.0))))


def _slabs_in_air(transport: _Transport, R: Floats, T: Floats, unscattered: Floats) -> Slabs:
    """Return slabs between two faces, lit from air."""
    flux, escapes = transport.flux, transport.escapes
    reflected, transmitted = _add_faces(R * flux, T * flux, unscattered, transport.internal, R, T)
    leaving = flux * (1.0 - transport.internal)
    entering = leaving[escapes] / leaving[escapes].sum()
    up, down = (np.einsum("k,nkm->nm", leaving, part[..., escapes]) for part in (reflected, transmitted))
    phase = transport.phase
    if phase.extinction < phase.unscaled_extinction:  # light in the truncated forward peak has scattered
        unscaled = unscattered ** (phase.unscaled_extinction / phase.extinction)
        scaled_up, scaled_down = _unscattered_exit(unscattered, transport.internal)
        true_up, true_down = _unscattered_exit(unscaled, transport.internal)
        up, down = up + (scaled_up - true_up)[:, escapes], down + (scaled_down - true_down)[:, escapes]
    return Slabs(transport.mu[escapes], entering, up, down)


def _unscattered_exit(unscattered: Floats, internal: Floats) -> tuple[Floats, Floats]:
    """Return unscattered light that leaves on the side of entry and on the far side, (n, m) each."""
    down = (1.0 - internal) * unscattered / (1.0 - (unscattered * internal) ** 2)
    return down * unscattered * internal, down


def _quadrature(eta: float, nodes: int) -> tuple[Floats, Floats]:
    """Return nodes and weights of cosines below the surface: escaping ones, then totally reflected ones."""
    critical = critical_cosine(eta)
    spans = [(critical, 1.0), (0.0, critical)] if critical > 0.0 else [(0.0, 1.0)]
    parts = [gauss_legendre(low, high, nodes) for low, high in spans]
    mu, weight = (np.concatenate(both) for both in zip(*parts, strict=True))
    return mu, weight


def _doubling_steps(
    transport: _Transport, tau: Floats, doublings: int
) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Yield reflection, transmission and unscattered light of very thin slabs, then of each doubling.

    Reflection and transmission are (n, m, m): radiance over pi per power from each direction. Unscattered
    light is (n, m).

    tau : (n,) first thickness in reduced mean free paths
    """
    mu, flux, albedo = transport.mu, transport.flux, transport.phase.albedo
    t = transport.phase.extinction * tau[:, None, None]
    a, b = mu[:, None], mu[None, :]
    R = -0.25 * albedo / (a + b) * np.expm1(-t * (1.0 / a + 1.0 / b)) * transport.phase.backward
    T = 0.25 * albedo * t / (a * b) * np.exp(-0.5 * t * (1.0 / a + 1.0 / b)) * transport.phase.forward
    unscattered = np.exp(-t[..., 0] / mu)
    yield R, T, unscattered
    for _ in range(doublings):
        up, down = R * flux, T * flux + unscattered[:, :, None] * np.eye(len(mu))
        entering = R * unscattered[:, None, :]
        between = np.linalg.solve(np.eye(len(mu)) - up @ up, T + up @ entering)
        R, T = R + down @ (up @ between + entering), down @ between + T * unscattered[:, None, :]
        unscattered = unscattered**2
        yield R, T, unscattered


def _add_faces(
    up: Floats, down: Floats, unscattered: Floats, internal: Floats, R: Floats, T: Floats
) -> tuple[Floats, Floats]:
    """Return scattered radiance over pi below the upper and above the lower face, per power that enters.

    up, down : (n, m, m) reflection and transmission operators of the slab
    internal : (m,) reflectance of a face from inside
    """
    if not internal.any():
        return R, T
    identity, count = np.eye(len(internal)), len(internal)
    passing = (down + unscattered[:, :, None] * identity) * internal
    system = np.block([[identity - up * internal, -passing], [-passing, identity - up * internal]])
    # Unscattered light is reflected back and forth between the faces.
    passes = 1.0 / (1.0 - (unscattered * internal) ** 2)
    below = internal * unscattered * passes
    top = R * (passes[:, None, :]) + T * below[:, None, :]
    bottom = T * passes[:, None, :] + R * below[:, None, :]
    solved = np.linalg.solve(system, np.concatenate([top, bottom], axis=1))
    return solved[:, :count], solved[:, count:]


def anisotropic_response(total: ArrayLike, eta: float, g: float) -> AngularResponse:
    """Return `angular_response` of half-spaces with anisotropic scattering and the same reduced coefficients.

    The single-scattering term changes by the difference of least-squares fits to all pairs of directions.

    total : (c,) reflectance of half-spaces that scatter isotropically [-]
    eta : index of refraction relative to air, at least 1 [-]
    g : mean cosine of scattering, at least 0 [-]
    """
    isotropic = angular_response(total, eta)
    if g == 0.0:
        return isotropic
    columns, isotropic_columns = (
        interpolate_columns(partial(_response_column, eta, mean_cosine), total) for mean_cosine in (g, 0.0)
    )
    table, (diffuse, single_scattering) = columns[:DIRECTION_ROWS], columns[DIRECTION_ROWS:]
    single_scattering = isotropic.single_scattering + single_scattering - isotropic_columns[-1]
    return AngularResponse(eta, table, diffuse, single_scattering, isotropic.mean_kernel)


@lru_cache(maxsize=CACHE_SIZE)
def _response_column(eta: float, g: float, total: float) -> Floats:
    """Return relative and relative diffuse reflectance and single scattering, (DIRECTION_ROWS + 2,)."""
    a, fraction, radiance = half_space_radiance(albedo_for_reflectance(total, eta), eta, NODES, g)
    reflectance = fraction @ radiance
    normal = float(_interpolate(a, reflectance, np.ones(1))[0])
    if normal <= _MIN_REFLECTANCE:
        return np.append(np.ones(DIRECTION_ROWS + 1), 0.0)
    table = _interpolate(a, reflectance, refracted_cosine(np.linspace(0.0, 1.0, DIRECTION_ROWS) ** 2, eta))
    air = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - a**2), 0.0))
    kernel = 1.0 / (a[:, None] + a) - mean_single_scattering_kernel(air, eta)
    deviation = radiance - reflectance
    weight = np.outer(fraction, fraction)
    single_scattering = (weight * kernel * deviation).sum() / (weight * kernel**2).sum()
    return np.concatenate([table, [fraction @ reflectance, single_scattering]]) / normal


def _interpolate(known: Floats, values: Floats, cosine: Floats) -> Floats:
    """Interpolate values at cosines; beyond the known cosines, extrapolate."""
    order = np.argsort(known)
    x, y = known[order], values[order]
    found = np.interp(cosine, x, y)
    first, last = slice(_EXTRAPOLATION_POINTS), slice(-_EXTRAPOLATION_POINTS, None)
    for end, outside in ((first, cosine < x[0]), (last, cosine > x[-1])):
        polynomial = np.polyfit(x[end], y[end], _EXTRAPOLATION_POINTS - 1)
        found = np.where(outside, np.polyval(polynomial, cosine), found)
    return np.asarray(found)
