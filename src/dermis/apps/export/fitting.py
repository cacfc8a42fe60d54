"""Fits of other programs' diffusion profiles to a skin's reference profile, and the errors of these fits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.fits.burley import BurleyProfile
from dermis.optics.half_space import HalfSpaceKind, half_space, tabulated_albedo
from dermis.optics.media import Floats
from dermis.optics.radial import SMALLEST_FLOAT

_BURLEY_MEDIAN_RADIUS = 1.58  # radius within which half of the light leaves, in units of Burley's width d
_LOG_LENGTH_SEARCH_RANGE = np.log(
    30.0
)  # search range of lengths, around the length that gives equal median radii
_LENGTH_BISECTION_STEPS, _MEDIUM_BISECTION_STEPS = 40, 30
_MIN_WIDTH_MM = 1e-9
_MAX_RELATIVE_EDGE_DISTANCE, _EDGE_SAMPLE_COUNT = (
    12.0,
    97,
)  # largest distance from a shadow edge, in median radii
_MIN_RELATIVE_RADIUS, _MAX_RELATIVE_RADIUS, _RADIUS_SAMPLE_COUNT = (
    1e-2,
    60.0,
    400,
)  # of least squares fits, in median radii
_RELATIVE_CDF_RADII = np.geomspace(1e-4, 1e4, 2000)
_LOG_LENGTH_BOUND, _LOG_LENGTH_TOLERANCE = 2.0, 1e-4  # search range and tolerance of least squares fits


def cumulative_burley_profile(burley_width_mm: ArrayLike, energy: ArrayLike) -> CumulativeProfile:
    """Return the cumulative form of Burley's profile R(r) = A (exp(-r/d) + exp(-r/3d)) / (8 pi d r).

    The cumulative form gives the fraction of the emerging light that leaves within each radius.

    burley_width_mm : (3,) width d of each channel [mm]
    energy : (3,) total energy A of each channel: emerging light per incident light [-]
    """
    d = np.maximum(np.asarray(burley_width_mm, np.float64), _MIN_WIDTH_MM)
    return CumulativeProfile.from_function(BurleyProfile(np.ones(3), 1.0 / d).energy_within, energy)


def fit_burley_width(profile: CumulativeProfile) -> Floats:
    """Return the widths d (3,) of the Burley profiles closest to a cumulative profile [mm].

    For each channel, the largest difference between the cumulative Burley profile and `profile` is minimised.
    """
    median = np.array([np.interp(0.5, profile.fraction[:, i], profile.radii_mm) for i in range(3)])
    middle = np.log(median / _BURLEY_MEDIAN_RADIUS)

    def cdf_difference(log_width: Floats) -> Floats:
        return (
            BurleyProfile(np.ones(3), np.exp(-log_width)).energy_within(profile.radii_mm) - profile.fraction
        )

    return _bisect_minimax(
        cdf_difference,
        middle - _LOG_LENGTH_SEARCH_RANGE,
        middle + _LOG_LENGTH_SEARCH_RANGE,
        _LENGTH_BISECTION_STEPS,
    )


def cumulative_gaussian_profile(
    variance_mm2: Floats, gaussian_weight: Floats, energy: Floats
) -> CumulativeProfile:
    """Return the cumulative profile of a sum of Gaussians.

    variance_mm2 : (n,) variances of the Gaussians [mm2]
    gaussian_weight : (n, 3) weight of each Gaussian in red, green and blue; only the ratios of the weights
        matter [-]
    energy : (3,) total energy of the profile: emerging light per incident light [-]
    """
    fraction = gaussian_weight / gaussian_weight.sum(axis=0)

    def fraction_within(radius_mm: Floats) -> Floats:
        with np.errstate(under="ignore"):
            return np.asarray(1.0 - np.exp(-0.5 * radius_mm[:, None] ** 2 / variance_mm2) @ fraction)

    return CumulativeProfile.from_function(fraction_within, energy)


def scale_radii(unit_profile: CumulativeProfile, scale_mm: ArrayLike) -> CumulativeProfile:
    """Return a cumulative profile with the radii of each channel multiplied by a length.

    unit_profile : cumulative profile whose radii are in units of `scale_mm`
    scale_mm : (3,) length by which the radii of each channel are multiplied [mm]
    """
    scale = np.maximum(np.asarray(scale_mm, np.float64), _MIN_WIDTH_MM)

    def fraction_within(radius_mm: Floats) -> Floats:
        return np.stack([unit_profile.fraction_within(radius_mm / scale[i])[:, i] for i in range(3)], axis=-1)

    return CumulativeProfile.from_function(fraction_within, unit_profile.energy)


def fit_radius_scale(reference_profile: CumulativeProfile, unit_profile: CumulativeProfile) -> Floats:
    """Return the lengths (3,) by which a profile's radii are multiplied to match a reference profile [mm].

    In each channel, the largest difference between the scaled and the reference profile is minimised.

    unit_profile : cumulative profile to scale, whose radii are in units of the returned lengths
    """
    middle = np.log(reference_profile.radius_at_fraction(0.5) / unit_profile.radius_at_fraction(0.5))
    return _fit_radius_scale_in_range(
        reference_profile, unit_profile, middle, _LOG_LENGTH_SEARCH_RANGE, _LENGTH_BISECTION_STEPS - 1
    )


@dataclass(frozen=True)
class HomogeneousMedium:
    """Half-space of a homogeneous medium with isotropic scattering.

    albedo : (3,) reduced albedo [-]
    mfp_mm : (3,) reduced mean free path [mm]
    curve : cumulative profile of the light that leaves the half-space
    """

    albedo: Floats
    mfp_mm: Floats
    curve: CumulativeProfile


def fit_homogeneous_medium(
    reference_profile: CumulativeProfile,
    energy: Floats | None = None,
    half_space_kind: HalfSpaceKind = "skin",
) -> HomogeneousMedium:
    """Return the homogeneous medium whose cumulative profile is closest to a reference profile.

    energy : (3,) light that leaves the medium per incident light [-]; by default the energy of the reference
        profile
    half_space_kind : surface and illumination of the medium: "skin" (refracting surface of index 1.4, lit
        along the normal), "matched" (index-matched surface, lit along the normal) or "walk" (index-matched
        surface, lit from all directions)
    """
    albedo = tabulated_albedo(half_space_kind, reference_profile.energy if energy is None else energy)
    unit = half_space(half_space_kind, albedo, np.ones(3))
    middle = np.log(fit_burley_width(reference_profile) / fit_burley_width(unit))  # ratio of Burley widths
    mfp = _fit_radius_scale_in_range(reference_profile, unit, middle, 2.0, _MEDIUM_BISECTION_STEPS)
    return HomogeneousMedium(albedo, mfp, half_space(half_space_kind, albedo, mfp))


def _fit_radius_scale_in_range(
    reference_profile: CumulativeProfile,
    unit_profile: CumulativeProfile,
    centre_log_length: Floats,
    log_length_range: float,
    bisection_steps: int,
) -> Floats:
    def cdf_difference(log_scale: Floats) -> Floats:
        return scale_radii(unit_profile, np.exp(log_scale)).fraction - reference_profile.fraction

    return _bisect_minimax(
        cdf_difference,
        centre_log_length - log_length_range,
        centre_log_length + log_length_range,
        bisection_steps,
    )


def _bisect_minimax(
    cdf_difference: Callable[[Floats], Floats],
    min_log_length: Floats,
    max_log_length: Floats,
    bisection_steps: int,
) -> Floats:
    """Return the lengths (3,) by which a profile's radii are multiplied to match a reference profile.

    In each channel, the returned length minimises the largest absolute difference between the two cumulative
    profiles. At this length, the largest positive and the largest negative difference have the same
    magnitude. Bisection finds this length.

    cdf_difference : function that takes the logarithms of the lengths (3,) and returns the differences (n, 3)
        between the scaled and the reference cumulative profile, at n radii
    min_log_length, max_log_length : (3,) bounds of the logarithms of the lengths
    bisection_steps : number of times that the interval between the bounds is halved
    """
    for _ in range(bisection_steps):
        middle = 0.5 * (min_log_length + max_log_length)
        difference = cdf_difference(middle)
        too_narrow = difference.max(axis=0) > -difference.min(axis=0)
        min_log_length, max_log_length = (
            np.where(too_narrow, middle, min_log_length),
            np.where(too_narrow, max_log_length, middle),
        )
    return np.asarray(np.exp(0.5 * (min_log_length + max_log_length)))


def fit_length_scale(
    reference_profile: CumulativeProfile, colour_channel: int, unit_cdf: Callable[[Floats], Floats]
) -> float:
    """Return the length by which a profile's radii are multiplied to match a reference profile [mm].

    The sum of squared differences between the two cumulative profiles is minimised. The differences are
    taken at radii that are spaced evenly on a logarithmic scale.

    colour_channel : channel of the reference profile that is matched, 0 for red
    unit_cdf : cumulative profile to scale, as a function: it takes radii (n,) in units of the returned
        length, and returns the fraction of light (n,) within each radius
    """
    from scipy.optimize import minimize_scalar

    median = float(reference_profile.radius_at_fraction(0.5)[colour_channel])
    r = median * np.geomspace(_MIN_RELATIVE_RADIUS, _MAX_RELATIVE_RADIUS, _RADIUS_SAMPLE_COUNT)
    reference = reference_profile.fraction_within(r)[:, colour_channel]
    middle = np.log(median / float(np.interp(0.5, unit_cdf(_RELATIVE_CDF_RADII), _RELATIVE_CDF_RADII)))

    def squared_error(log_length: float) -> float:
        return float(((unit_cdf(r / np.exp(log_length)) - reference) ** 2).sum())

    bounds = middle - _LOG_LENGTH_BOUND, middle + _LOG_LENGTH_BOUND
    result = minimize_scalar(
        squared_error, bounds=bounds, method="bounded", options={"xatol": _LOG_LENGTH_TOLERANCE}
    )
    return float(np.exp(result.x))


@dataclass(frozen=True)
class ProfileError:
    """Errors of the profile that a program renders, relative to the reference profile, by colour channel.

    cdf : (3,) largest difference between the two profiles in the fraction of light within a radius [-]
    edge : (3,) largest difference between the two profiles in the brightness beside a straight shadow edge,
        which each profile blurs [-]
    energy : (3,) relative error of the total energy [-]
    """

    cdf: Floats
    edge: Floats
    energy: Floats

    def as_json(self) -> dict[str, list[float]]:
        """Return a dictionary from the name of each error to its values in red, green and blue."""
        return {name: [round(float(x), 6) for x in getattr(self, name)] for name in ("cdf", "edge", "energy")}


def profile_error(reference_profile: CumulativeProfile, rendered_profile: CumulativeProfile) -> ProfileError:
    """Return the errors of a cumulative profile relative to a reference profile."""
    steps = np.geomspace(1e-3, 1.0, _EDGE_SAMPLE_COUNT)
    widest = _MAX_RELATIVE_EDGE_DISTANCE * np.maximum(
        reference_profile.radius_at_fraction(0.5), rendered_profile.radius_at_fraction(0.5)
    )
    edge = np.zeros(3)
    for i in range(3):
        x = widest[i] * steps
        edge[i] = np.abs(rendered_profile.edge_response(x) - reference_profile.edge_response(x))[:, i].max()
    return ProfileError(
        cdf=np.abs(
            rendered_profile.fraction_within(reference_profile.radii_mm) - reference_profile.fraction
        ).max(axis=0),
        edge=edge,
        energy=rendered_profile.energy / np.maximum(reference_profile.energy, SMALLEST_FLOAT) - 1.0,
    )
