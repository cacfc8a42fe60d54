"""Reflection and transmission of slabs with anisotropic scattering, by adding and doubling."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.optics.angular_response import (
    CACHED_COLUMN_COUNT,
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
DIRECTION_NODE_COUNT = 16
"""Default number of discrete directions in which light can leave a slab, see `solve_slabs`."""
DEEP_OPTICAL_DEPTH = 1e4
"""Thickness from which a slab is treated as a half-space [mean free paths]."""
_MIN_OPTICAL_DEPTH = 1e-6  # optical depth of a slab in which light scatters at most once
_EXTRAPOLATION_POINT_COUNT = 3  # number of cosines from which values beyond the last cosine are extrapolated
_MIN_REFLECTANCE = 1e-12


@dataclass(frozen=True, eq=False)
class PhaseMatrices:
    """Phase function averaged over azimuth, as matrices between m discrete directions.

    Light in the forward peak of the phase function is treated as unscattered. The medium is therefore
    replaced by a scaled medium, which has no such peak and scatters less than the true medium.

    albedo : single-scattering albedo of the scaled medium [-]
    extinction : extinction coefficient of the scaled medium, relative to the reduced extinction coefficient
        [-]
    unscaled_extinction : extinction coefficient of the true medium, relative to the reduced extinction
        coefficient [-]
    backward : (m, m) phase function between two directions, for light that turns from downwards to upwards or
        vice versa; 1 for isotropic scattering [-]
    forward : (m, m) phase function between two directions, for light that continues downwards or upwards; 1
        for isotropic scattering [-]
    """

    albedo: float
    extinction: float
    unscaled_extinction: float
    backward: Floats
    forward: Floats


def phase_matrices(albedo: float, g: float, cosine: Floats, polynomial_count: int) -> PhaseMatrices:
    """Return the Henyey-Greenstein phase function between discrete directions, from Legendre polynomials.

    albedo : reduced albedo [-]
    g : mean cosine of the scattering angle, at least 0 and less than 1 [-]
    cosine : (m,) cosines of the directions from the normal
    polynomial_count : number of polynomials; light scattered by further terms is treated as unscattered

    Sources: [HenyeyGreenstein1941]; [Wiscombe1977] for the truncated forward peak.
    """
    unscaled = 1.0 + albedo * g / (1.0 - g)
    single, peak = albedo / ((1.0 - g) * unscaled), g**polynomial_count
    order = np.arange(polynomial_count)
    moment = (2.0 * order + 1.0) * (g**order - peak) / (1.0 - peak)
    P = np.polynomial.legendre.legvander(cosine, polynomial_count - 1)
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
    """Power reflected and transmitted by slabs in air, for n thicknesses and m incident directions.

    cosine : (m,) cosines of the directions, after refraction into the slab [-]
    flux : (m,) fraction of the entering light of a uniform sky that takes each direction; the sum is 1 [-]
    reflected : (n, m) fraction of the entering light that scatters and leaves on the side of entry [-]
    transmitted : (n, m) fraction of the entering light that scatters and leaves on the far side [-]
    """

    cosine: Floats
    flux: Floats
    reflected: Floats
    transmitted: Floats


def solve_slabs(
    albedo: float,
    optical_depth: ArrayLike,
    eta: float,
    direction_node_count: int = DIRECTION_NODE_COUNT,
    g: float = 0.0,
) -> Slabs:
    """Return the reflection and transmission of slabs, computed by adding and doubling.

    The result is exact except for the discretisation of directions.

    albedo : single-scattering albedo, or the reduced albedo if scattering is anisotropic [-]
    optical_depth : (n,) thicknesses above 0, in mean free paths; in reduced mean free paths if scattering is
        anisotropic [-]
    eta : index of refraction relative to the air on both sides, at least 1 [-]
    direction_node_count : number of discrete directions in which light can leave the slab; if eta is above 1,
        the computation adds as many directions with total reflection
    g : mean cosine of the scattering angle, at least 0 [-]

    Source: [Chandrasekhar1960] section 50 for the addition of layers.
    """
    tau = np.atleast_1d(np.asarray(optical_depth, np.float64))
    transport = _Transport.create(albedo, eta, direction_node_count, g)
    doublings = transport.doubling_count(float(tau.max()))
    *_, (R, T, unscattered_fraction) = _doubling_steps(transport, tau / 2.0**doublings, doublings)
    return _slabs_in_air(transport, R, T, unscattered_fraction)


def solve_doubled_slabs(
    albedo: float,
    smallest_depth: ArrayLike,
    doubling_count: int,
    eta: float,
    direction_node_count: int = DIRECTION_NODE_COUNT,
    g: float = 0.0,
) -> Slabs:
    """Return the reflection and transmission of slabs, and of slabs that are 2, 4, 8 ... times as thick.

    This takes about as long as `solve_slabs` for the thickest slabs alone.

    albedo, eta, direction_node_count, g : as in `solve_slabs`
    smallest_depth : (n,) optical depths before the doublings; they should be of similar size [-]
    doubling_count : number d of doublings; the result has n (d + 1) slabs, ordered by the number of
        doublings, then by `smallest_depth`
    """
    transport = _Transport.create(albedo, eta, direction_node_count, g)
    initial_doublings = transport.doubling_count(float(np.max(smallest_depth)))
    tau = np.asarray(smallest_depth, np.float64) / 2.0**initial_doublings
    steps = list(_doubling_steps(transport, tau, initial_doublings + doubling_count))[initial_doublings:]
    R, T, unscattered_fraction = (np.concatenate(part) for part in zip(*steps, strict=True))
    return _slabs_in_air(transport, R, T, unscattered_fraction)


def half_space_radiance(
    albedo: float, eta: float, direction_node_count: int, g: float
) -> tuple[Floats, Floats, Floats]:
    """Return the radiance that emerges from a half-space in each of m discrete directions.

    The results are:

    - the cosines (m,) of the directions below the surface;
    - the fraction (m,) of the light from a uniform sky that enters in each direction;
    - the emerging radiance (m, m), with a row for each exit direction and a column for each entry direction.

    The radiance is scaled so that the mean of each column, weighted by the fractions, is the reflectance.

    The arguments are those of `solve_slabs`; m is `direction_node_count`.
    """
    transport = _Transport.create(albedo, eta, direction_node_count, g)
    doublings = transport.doubling_count(DEEP_OPTICAL_DEPTH)
    tau = np.array([DEEP_OPTICAL_DEPTH / 2.0**doublings])
    *_, (R, T, unscattered_fraction) = _doubling_steps(transport, tau, doublings)
    reflected, _ = _add_faces(
        R * transport.flux, T * transport.flux, unscattered_fraction, transport.internal, R, T
    )
    leaving = (transport.flux * (1.0 - transport.internal))[transport.escapes]
    radiance = reflected[0][np.ix_(transport.escapes, transport.escapes)] * leaving.sum()
    return transport.mu[transport.escapes], leaving / leaving.sum(), radiance


@dataclass(frozen=True, eq=False)
class _Transport:
    """Discrete directions in a medium, scattering from one direction to another, and reflection at the faces.

    mu : (m,) cosines of the angles between the directions and the normal [-]
    flux : (m,) share of each direction in the flux through a face, if the radiance inside the medium is the
        same in all directions [-]
    internal : (m,) reflectance of the faces from inside [-]
    escapes : (m,) mask of the directions that are not totally reflected at a face
    phase : phase function between the directions
    """

    mu: Floats
    flux: Floats
    internal: Floats
    escapes: NDArray[np.bool_]
    phase: PhaseMatrices

    @classmethod
    def create(cls, albedo: float, eta: float, direction_node_count: int, g: float) -> _Transport:
        mu, weight = _direction_quadrature(eta, direction_node_count)
        internal, escapes = internal_reflectance(mu, eta), mu > critical_cosine(eta)
        return cls(
            mu, 2.0 * weight * mu, internal, escapes, phase_matrices(albedo, g, mu, direction_node_count)
        )

    def doubling_count(self, depth: float) -> int:
        """Return how often a slab thin enough for single scattering must be doubled to reach a thickness.

        depth : thickness after the doublings, in reduced mean free paths [-]
        """
        return int(np.ceil(np.log2(max(depth * self.phase.extinction / _MIN_OPTICAL_DEPTH, 1.0))))


def _slabs_in_air(
    transport: _Transport, reflection: Floats, transmission: Floats, unscattered_fraction: Floats
) -> Slabs:
    """Return the reflection and transmission of slabs in air, computed from slabs with index-matched faces.

    transport : discrete directions, and reflectance of the faces
    reflection, transmission : (n, m, m) reflection and transmission with index-matched faces, as pi times the
        radiance for unit power from each direction
    unscattered_fraction : (n, m) fraction of light that crosses the slab without scattering [-]
    """
    flux, escapes = transport.flux, transport.escapes
    reflected, transmitted = _add_faces(
        reflection * flux,
        transmission * flux,
        unscattered_fraction,
        transport.internal,
        reflection,
        transmission,
    )
    leaving = flux * (1.0 - transport.internal)
    entering = leaving[escapes] / leaving[escapes].sum()
    up, down = (np.einsum("k,nkm->nm", leaving, part[..., escapes]) for part in (reflected, transmitted))
    phase = transport.phase
    if phase.extinction < phase.unscaled_extinction:  # light in the truncated forward peak has scattered
        unscaled = unscattered_fraction ** (phase.unscaled_extinction / phase.extinction)
        scaled_up, scaled_down = _unscattered_exit(unscattered_fraction, transport.internal)
        true_up, true_down = _unscattered_exit(unscaled, transport.internal)
        up, down = up + (scaled_up - true_up)[:, escapes], down + (scaled_down - true_down)[:, escapes]
    return Slabs(transport.mu[escapes], entering, up, down)


def _unscattered_exit(unscattered_fraction: Floats, face_reflectance: Floats) -> tuple[Floats, Floats]:
    """Return the fractions (n, m) of light that leave unscattered on the side of entry and the far side [-].

    unscattered_fraction : (n, m) fraction of light that crosses the slab without scattering [-]
    face_reflectance : (m,) reflectance of a face from inside [-]
    """
    down = (
        (1.0 - face_reflectance)
        * unscattered_fraction
        / (1.0 - (unscattered_fraction * face_reflectance) ** 2)
    )
    return down * unscattered_fraction * face_reflectance, down


def _direction_quadrature(eta: float, direction_node_count: int) -> tuple[Floats, Floats]:
    """Return quadrature nodes and weights for the cosines of directions in a medium.

    Directions that escape come first, then those that are totally reflected at the faces, if there are any.
    """
    critical = critical_cosine(eta)
    spans = [(critical, 1.0), (0.0, critical)] if critical > 0.0 else [(0.0, 1.0)]
    parts = [gauss_legendre(low, high, direction_node_count) for low, high in spans]
    mu, weight = (np.concatenate(both) for both in zip(*parts, strict=True))
    return mu, weight


def _doubling_steps(
    transport: _Transport, initial_depth: Floats, doubling_count: int
) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Yield reflection, transmission and unscattered light of slabs, then of slabs twice as thick, and so on.

    Reflection and transmission (n, m, m) are pi times the radiance for unit power from each direction. The
    unscattered light (n, m) is the fraction that crosses the slab without scattering.

    transport : discrete directions, and phase function of the medium
    initial_depth : (n,) initial thicknesses in reduced mean free paths
    doubling_count : number of doublings
    """
    mu, flux, albedo = transport.mu, transport.flux, transport.phase.albedo
    t = transport.phase.extinction * initial_depth[:, None, None]
    a, b = mu[:, None], mu[None, :]
    R = -0.25 * albedo / (a + b) * np.expm1(-t * (1.0 / a + 1.0 / b)) * transport.phase.backward
    T = 0.25 * albedo * t / (a * b) * np.exp(-0.5 * t * (1.0 / a + 1.0 / b)) * transport.phase.forward
    unscattered_fraction = np.exp(-t[..., 0] / mu)
    yield R, T, unscattered_fraction
    for _ in range(doubling_count):
        up, down = R * flux, T * flux + unscattered_fraction[:, :, None] * np.eye(len(mu))
        entering = R * unscattered_fraction[:, None, :]
        between = np.linalg.solve(np.eye(len(mu)) - up @ up, T + up @ entering)
        R, T = R + down @ (up @ between + entering), down @ between + T * unscattered_fraction[:, None, :]
        unscattered_fraction = unscattered_fraction**2
        yield R, T, unscattered_fraction


def _add_faces(
    reflection_operator: Floats,
    transmission_operator: Floats,
    unscattered_fraction: Floats,
    face_reflectance: Floats,
    reflection: Floats,
    transmission: Floats,
) -> tuple[Floats, Floats]:
    """Return the scattered light that arrives at the faces of reflecting slabs from inside.

    The light has been scattered at least once, and may have been reflected by the faces any number of times.
    The results (n, m, m) are pi times the radiance at the upper face and at the lower face. Each column is
    for light of unit power that enters in one direction.

    reflection_operator, transmission_operator : (n, m, m) matrices that convert the radiance of light inside
        a face to the reflected and transmitted radiance: `reflection` and `transmission` below, with each
        column multiplied by the flux of its direction
    unscattered_fraction : (n, m) fraction of light that crosses the slab without scattering [-]
    face_reflectance : (m,) reflectance of a face from inside [-]
    reflection, transmission : (n, m, m) reflection and transmission of the slabs if their faces did not
        reflect, as pi times the radiance for unit power from each direction
    """
    if not face_reflectance.any():
        return reflection, transmission
    identity, count = np.eye(len(face_reflectance)), len(face_reflectance)
    passing = (transmission_operator + unscattered_fraction[:, :, None] * identity) * face_reflectance
    system = np.block(
        [
            [identity - reflection_operator * face_reflectance, -passing],
            [-passing, identity - reflection_operator * face_reflectance],
        ]
    )
    # Unscattered light is reflected back and forth between the faces.
    passes = 1.0 / (1.0 - (unscattered_fraction * face_reflectance) ** 2)
    below = face_reflectance * unscattered_fraction * passes
    top = reflection * (passes[:, None, :]) + transmission * below[:, None, :]
    bottom = transmission * passes[:, None, :] + reflection * below[:, None, :]
    solved = np.linalg.solve(system, np.concatenate([top, bottom], axis=1))
    return solved[:, :count], solved[:, count:]


def anisotropic_response(total_reflectance: ArrayLike, eta: float, g: float) -> AngularResponse:
    """Return the angular response of half-spaces with anisotropic scattering.

    The half-spaces have the same absorption and reduced scattering coefficients as isotropically scattering
    half-spaces with the reflectance `total_reflectance`.

    total_reflectance : (c,) reflectance of the isotropic half-spaces for light at normal incidence [-]
    eta : index of refraction relative to air, at least 1 [-]
    g : mean cosine of the scattering angle, at least 0 [-]

    The field `single_scattering` is that of `angular_response` plus a correction for anisotropy. To find the
    correction, this field is fitted to the emerging radiance by least squares, once for g and once for
    isotropic scattering. The correction is the difference of the two fits.
    """
    isotropic = angular_response(total_reflectance, eta)
    if g == 0.0:
        return isotropic
    columns, isotropic_columns = (
        interpolate_columns(partial(_angular_response_column, eta, mean_cosine), total_reflectance)
        for mean_cosine in (g, 0.0)
    )
    table, (diffuse, single_scattering) = columns[:DIRECTION_ROWS], columns[DIRECTION_ROWS:]
    single_scattering = isotropic.single_scattering + single_scattering - isotropic_columns[-1]
    return AngularResponse(eta, table, diffuse, single_scattering, isotropic.mean_kernel)


@lru_cache(maxsize=CACHED_COLUMN_COUNT)
def _angular_response_column(eta: float, g: float, total_reflectance: float) -> Floats:
    """Return fields of `AngularResponse` for one channel, as one column (DIRECTION_ROWS + 2,) of a table.

    The first DIRECTION_ROWS elements are `relative_reflectance`; the last two are
    `relative_diffuse_reflectance` and `single_scattering`.

    eta : index of refraction relative to air [-]
    g : mean cosine of the scattering angle [-]
    total_reflectance : reflectance of the isotropic half-space for light at normal incidence [-]
    """
    a, fraction, radiance = half_space_radiance(
        albedo_for_reflectance(total_reflectance, eta), eta, DIRECTION_NODE_COUNT, g
    )
    reflectance = fraction @ radiance
    normal = float(_interpolate_over_cosines(a, reflectance, np.ones(1))[0])
    if normal <= _MIN_REFLECTANCE:
        return np.append(np.ones(DIRECTION_ROWS + 1), 0.0)
    table = _interpolate_over_cosines(
        a, reflectance, refracted_cosine(np.linspace(0.0, 1.0, DIRECTION_ROWS) ** 2, eta)
    )
    air = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - a**2), 0.0))
    kernel = 1.0 / (a[:, None] + a) - mean_single_scattering_kernel(air, eta)
    deviation = radiance - reflectance
    weight = np.outer(fraction, fraction)
    single_scattering = (weight * kernel * deviation).sum() / (weight * kernel**2).sum()
    return np.concatenate([table, [fraction @ reflectance, single_scattering]]) / normal


def _interpolate_over_cosines(sample_cosine: Floats, sample_values: Floats, cosine: Floats) -> Floats:
    """Return values at given cosines, interpolated linearly between samples.

    Beyond the first and the last sample, the values are extrapolated by a polynomial.

    sample_cosine : (m,) cosines of the samples
    sample_values : (m,) values of the samples
    cosine : cosines at which the values are returned
    """
    order = np.argsort(sample_cosine)
    x, y = sample_cosine[order], sample_values[order]
    interpolated = np.interp(cosine, x, y)
    first, last = slice(_EXTRAPOLATION_POINT_COUNT), slice(-_EXTRAPOLATION_POINT_COUNT, None)
    for end, outside in ((first, cosine < x[0]), (last, cosine > x[-1])):
        polynomial = np.polyfit(x[end], y[end], _EXTRAPOLATION_POINT_COUNT - 1)
        interpolated = np.where(outside, np.polyval(polynomial, cosine), interpolated)
    return np.asarray(interpolated)
