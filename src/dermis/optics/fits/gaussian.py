"""Fits of sums of Gaussians to one diffusion profile, or to several profiles with shared variances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np

from dermis.base.errors import refuse
from dermis.base.renamed import renamed_keywords
from dermis.optics.fits.targets import PointTarget, RingTarget
from dermis.optics.fits.variable_projection import COST_TOLERANCE, DesignFunction, WeightedFit, minimise
from dermis.optics.gaussians import MAX_VARIANCE_MM2, GaussianSum
from dermis.optics.media import Floats

FitTarget = PointTarget | RingTarget
MAX_FITTED_GAUSSIANS = 8
# Fractions of the light within the standard deviations of the narrowest and the widest Gaussian of a start.
# For all tested profiles, one of these starts leads to the smallest error found from any start.
_START_LIGHT_FRACTIONS = ((0.02, 0.99), (0.1, 0.999), (0.02, 0.9), (0.1, 0.6), (0.001, 0.99))
# Tolerance of fits that start from a similar fit: their ring energies differ from those of the converged fit
# by at most 0.06 % of the brightest ring, and their errors by at most 0.0001.
_COST_TOLERANCE_FROM_SIMILAR_FIT = 3e-6
_ENERGY_EQUATION_WEIGHT = 1e4  # weight of the energy equation; its square bounds the error of the energy
SHARED_GAUSSIAN_COUNT = 6
"""Number of Gaussians in a fit of several profiles with shared variances."""
_RING_EDGES_MM = np.concatenate([[0.0], np.geomspace(1e-3, 60.0, 93)])
_MAX_CACHED_FITS = 8
_HashableGaussianSum = tuple[str, bytes, bytes, int]


@dataclass(frozen=True)
class GaussianFit:
    """Sum of Gaussians fitted to a diffusion profile, with the errors of the fit.

    profile : fitted sum of Gaussians
    error : (c,) relative root-mean-square error of the samples of R(r), or of the light through rings [-]
    energy_error : (c,) relative error of the total reflectance [-]
    kind : "pointwise" if the fit was to samples of R(r), "annulus" if it was to the light that emerges
        through concentric rings
    shared : whether all channels use the same variances
    """

    profile: GaussianSum
    error: Floats
    energy_error: Floats
    kind: Literal["pointwise", "annulus"]
    shared: bool


@renamed_keywords(near="similar_fit", initial="similar_fit")
def fit_gaussians(
    target: FitTarget,
    terms: int,
    *,
    shared: bool = True,
    keep_energy: bool = False,
    similar_fit: GaussianSum | None = None,
    profile_name: str = "fit",
) -> GaussianFit:
    """Fit a sum of Gaussians with the smallest error to a diffusion profile.

    target : samples of R(r), or light through rings
    terms : number of Gaussians in each channel, 1 to 8
    shared : whether the Gaussians of all channels are fitted with the same variances, which then minimise the
        root mean square of the channels' errors. Otherwise, each channel is fitted separately, and its
        weights at the variances of other channels are 0
    keep_energy : whether the weights must sum to the target's total reflectance
    similar_fit : fit of a similar profile; the search starts from its variances, which is several times
        faster but may miss the best fit
    profile_name : name of the fitted profile

    Raises DermisError for an invalid number of terms, and when no Gaussians fit the profile.

    Source: [dEonLuebke2007] section 14.4 for the error that is minimised.
    """
    if not 1 <= terms <= MAX_FITTED_GAUSSIANS:
        refuse(
            "terms of a fit",
            f"1 to {MAX_FITTED_GAUSSIANS} Gaussians",
            f"got {terms}",
            "Choose another number",
        )
    groups = [target] if shared else [target.channel(i) for i in range(len(target.total))]
    fits = [
        _fit_channels(group, terms, keep_energy, _variances_of_fit(similar_fit, None if shared else i, terms))
        for i, group in enumerate(groups)
    ]
    profile = _combine_fits(fits, profile_name)
    return GaussianFit(
        profile=profile,
        error=target.error(profile.variance_mm2, profile.weight),
        energy_error=profile.albedo / target.total - 1.0,
        kind=target.kind,
        shared=shared,
    )


def _fit_channels(
    target: FitTarget, gaussian_count: int, keep_energy: bool, start_variances_mm2: Floats | None
) -> tuple[Floats, Floats]:
    """Fit k Gaussians to the channels of a target; return variances (k,) and weights (k, c).

    target : samples of R(r), or light through rings
    gaussian_count : number k of Gaussians
    keep_energy : whether the weights must sum to the target's total reflectance
    start_variances_mm2 : (k,) variances from which the search starts; None for several default starts [mm2]
    """
    norm = np.linalg.norm(target.samples, axis=0)
    design, samples = (
        _with_energy_equation(target)
        if keep_energy
        else (target.design_matrix_and_derivatives, target.samples)
    )
    bounds = _log_variance_bounds(target)

    def minimise_from(start: Floats, tolerance: float = COST_TOLERANCE) -> WeightedFit:
        return minimise(design, samples / norm, np.clip(start, *bounds), bounds, tolerance)

    best = (
        None
        if start_variances_mm2 is None
        else minimise_from(np.log(start_variances_mm2), _COST_TOLERANCE_FROM_SIMILAR_FIT)
    )
    if best is None or not best.weight.any(axis=1).all():  # another start may use all Gaussians
        best = min(
            (minimise_from(start) for start in _initial_variances(target, gaussian_count)),
            key=lambda fit: fit.cost,
        )
    weight = best.weight * norm
    if not weight.any(axis=0).all():
        actual = "no weights of 0 or more fit it"
        refuse(f"{target.kind} target", "a profile that Gaussians can fit", actual, "Check its numbers")
    if keep_energy:
        weight *= target.total / weight.sum(axis=0)
    used = weight.any(axis=1)
    return np.exp(best.log_variance[used]), weight[used]


def _initial_variances(target: FitTarget, gaussian_count: int) -> list[Floats]:
    ends = [np.log(target.mean_radius_at(fractions) ** 2 / 2.0) for fractions in _START_LIGHT_FRACTIONS]
    return [np.linspace(low, high, gaussian_count) for low, high in ends]


def _log_variance_bounds(target: FitTarget) -> tuple[float, float]:
    """Return the logarithms of the smallest and the largest variance that a fit may use.

    Standard deviations range from half the first radius of the target to the last radius of the target.
    """
    radius = target.radius_mm if isinstance(target, PointTarget) else target.edges_mm[1:]
    return float(2.0 * np.log(radius[0] / 2.0)), float(np.log(min(radius[-1] ** 2, MAX_VARIANCE_MM2)))


def _with_energy_equation(target: FitTarget) -> tuple[DesignFunction, Floats]:
    """Return the least-squares equations of a target, with an equation for the total reflectance added.

    The first result is a function from the variances to the matrix of the equations and the derivatives of
    this matrix. The second result holds the right-hand sides of the equations. The added equation demands
    that the weights of the Gaussians sum to the total reflectance. Its own weight in the fit is so large that
    it holds almost exactly.
    """
    width = target.mean_radius_at([0.5]) ** 2 / 2.0
    stiffness = _ENERGY_EQUATION_WEIGHT * float(
        np.linalg.norm(target.design_matrix_and_derivatives(width)[0])
    )

    def design_matrix_and_derivatives(variance_mm2: Floats) -> tuple[Floats, Floats]:
        columns, slopes = target.design_matrix_and_derivatives(variance_mm2)
        row = np.ones((1, len(variance_mm2)))
        return np.vstack([stiffness * row, columns]), np.vstack([0.0 * row, slopes])

    return design_matrix_and_derivatives, np.vstack([stiffness * target.total, target.samples])


def _variances_of_fit(
    similar_fit: GaussianSum | None, channel: int | None, gaussian_count: int
) -> Floats | None:
    """Return the variances of a similar fit as the start of a new fit.

    The result is None if there is no similar fit, or if its number of Gaussians is not `gaussian_count`.

    similar_fit : similar fit, or None
    channel : index of the channel whose Gaussians are used; None to use the Gaussians of all channels
    gaussian_count : number of Gaussians of the new fit
    """
    if similar_fit is None:
        return None
    used = similar_fit.weight.any(axis=1) if channel is None else similar_fit.weight[:, channel] > 0.0
    return similar_fit.variance_mm2[used] if used.sum() == gaussian_count else None


def _combine_fits(channel_fits: list[tuple[Floats, Floats]], profile_name: str) -> GaussianSum:
    """Combine fits of separate channels into one sum of Gaussians, in which equal variances occur once.

    channel_fits : variances (k,) and weights (k, c) of each fit
    profile_name : name of the resulting profile
    """
    variance, index = np.unique(np.concatenate([v for v, _ in channel_fits]), return_inverse=True)
    channels = sum(w.shape[1] for _, w in channel_fits)
    weight = np.zeros((len(variance), channels))
    row = channel = 0
    for v, w in channel_fits:
        rows = index[row : row + len(v)]
        np.add.at(weight[:, channel : channel + w.shape[1]], rows, w)
        row, channel = row + len(v), channel + w.shape[1]
    return GaussianSum(profile_name, variance, weight)


def single_gaussian(profile: GaussianSum) -> GaussianSum:
    """Fit one Gaussian to a profile by least squares, without changing the total reflectance.

    The squared error is integrated over the surface, and summed over the channels. Early skin shading blurred
    light maps by a single Gaussian [Borshukov2003; Green2004].
    """
    from scipy.optimize import minimize_scalar

    def gaussian_of_log_variance(log_variance: float) -> GaussianSum:
        name, variance = f"{profile.name}, one blur", np.exp([log_variance])
        return GaussianSum(name, variance, profile.albedo[None], profile.from_photons)

    def squared_error(log_variance: float) -> float:
        gaussian = gaussian_of_log_variance(log_variance)
        return float((gaussian.inner_product(gaussian) - 2 * gaussian.inner_product(profile)).sum())

    ends = np.log(profile.variance_mm2[[0, -1]])
    return gaussian_of_log_variance(
        minimize_scalar(squared_error, bounds=(ends[0] - 1e-6, ends[1] + 1e-6), method="bounded").x
    )


def shared_gaussians(
    profiles: Sequence[GaussianSum], gaussian_count: int = SHARED_GAUSSIAN_COUNT
) -> tuple[GaussianSum, ...]:
    """Fit several profiles with one set of variances, so that all profiles can use the same series of blurs.

    The total reflectances do not change. Profiles that already have the same variances are returned
    unchanged.

    profiles : the profiles, each a sum of Gaussians
    gaussian_count : number of Gaussians of each fit
    """
    first = profiles[0].variance_mm2
    if all(np.array_equal(first, one.variance_mm2) for one in profiles):
        return tuple(profiles)
    fitted = _fit_shared_variances(tuple(map(_hashable_gaussian_sum, profiles)), gaussian_count)
    pairs = zip(fitted, profiles, strict=True)
    return tuple(replace(fit, from_photons=profile.from_photons) for fit, profile in pairs)


@lru_cache(_MAX_CACHED_FITS)
def _fit_shared_variances(
    hashable_gaussian_sums: tuple[_HashableGaussianSum, ...], gaussian_count: int
) -> tuple[GaussianSum, ...]:
    profiles = [
        GaussianSum(name, np.frombuffer(variance), np.frombuffer(weight).reshape(-1, channels))
        for name, variance, weight, channels in hashable_gaussian_sums
    ]
    fit = fit_gaussians(
        _combined_ring_target(profiles), gaussian_count, keep_energy=True, profile_name="shared profiles"
    ).profile
    ends = np.cumsum([one.weight.shape[1] for one in profiles])[:-1]
    parts = np.split(fit.weight, ends, axis=1)
    pairs = zip(profiles, parts, strict=True)
    return tuple(GaussianSum(profile.name, fit.variance_mm2, part) for profile, part in pairs)


def _hashable_gaussian_sum(profile: GaussianSum) -> _HashableGaussianSum:
    return profile.name, profile.variance_mm2.tobytes(), profile.weight.tobytes(), profile.weight.shape[1]


def _combined_ring_target(profiles: Sequence[GaussianSum]) -> RingTarget:
    """Return the light of several profiles through rings, as one target with the channels of all profiles."""
    within = np.hstack([one.energy_within(_RING_EDGES_MM) for one in profiles])
    return RingTarget(_RING_EDGES_MM, np.diff(within, axis=0), np.hstack([one.albedo for one in profiles]))
