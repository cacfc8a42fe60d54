"""Homogeneous medium equivalent to a diffusion profile, and the lateral shift of obliquely incident light."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from dermis.optics.angular_response import CACHED_COLUMN_COUNT, interpolate_table
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.diffusion import hankel, layered_diffusion
from dermis.optics.diffusion.boundary import boundary_mismatch
from dermis.optics.gaussians import GaussianSum
from dermis.optics.half_space import half_space, half_space_kind_for_eta, tabulated_albedo
from dermis.optics.media import Layer, Medium

Floats = NDArray[np.float64]
MAX_EQUIVALENT_ALBEDO, MIN_EQUIVALENT_ALBEDO = 1.0 - 1e-6, 1e-3
_LOG_FREQUENCY_RANGE = (-14.0, 14.0)  # natural logarithms of frequencies [1/mm]
_ABSORPTION_WEIGHT_IN_OFFSET = 0.35  # of absorption in the published formula of the offset


def equivalent_medium(profile: GaussianSum, total_reflectance: Floats, eta: float) -> Medium:
    """Return the half-space that has a given reflectance and spreads light as widely as a given profile.

    The Hankel transform of a profile R(r) decreases with frequency. The width of the profile is the inverse
    of the frequency at which the transform is half of its value at frequency 0.

    profile : diffusion profile
    total_reflectance : (c,) reflectance of the half-space for light at normal incidence [-]
    eta : index of refraction relative to air [-]
    """
    albedo, extinction = np.empty(len(total_reflectance)), np.empty(len(total_reflectance))
    for c, reflectance in enumerate(total_reflectance):
        column = partial(_equivalent_half_space_column, eta, profile.from_photons)
        root, half = interpolate_table(column, float(reflectance))
        gaussians = tuple(zip(profile.variance_mm2.tolist(), profile.weight[:, c].tolist(), strict=True))
        albedo[c] = 1.0 - root**2
        extinction[c] = _half_frequency(partial(_gaussian_transform, gaussians)) / half
    layer = Layer((1.0 - albedo) * extinction, albedo * extinction)
    return Medium("half-space", (layer,), eta)


@lru_cache(maxsize=CACHED_COLUMN_COUNT)
def _equivalent_half_space_column(eta: float, use_photon_table: bool, total_reflectance: float) -> Floats:
    """Return two properties of the half-space with a given reflectance, as a column (2,) of a table.

    The first element is the square root of 1 minus the single-scattering albedo [-]. The second element is
    the frequency at which the Hankel transform of R(r) is half of its value at frequency 0 [1 / mean free
    path].

    eta : index of refraction relative to air [-]
    use_photon_table : whether R(r) comes from a table of Monte Carlo results, if one exists, instead of
        layered diffusion
    total_reflectance : reflectance for light at normal incidence [-]
    """
    albedo = albedo_for_total_reflectance(total_reflectance, eta, use_photon_table)
    kind = half_space_kind_for_eta(eta) if use_photon_table else None
    if kind is None:
        half = _half_frequency(partial(_reflectance_transform, _unit_mean_free_path_medium(albedo, eta)))
    else:
        cumulative = half_space(kind, np.full(3, albedo), np.ones(3))
        half = _half_frequency(partial(_cumulative_transform, cumulative))
    return np.array([np.sqrt(1.0 - albedo), half])


def albedo_for_total_reflectance(
    total_reflectance: float, eta: float, use_photon_table: bool = False
) -> float:
    """Return the single-scattering albedo of the half-space with a given total reflectance [-].

    total_reflectance : reflectance for light at normal incidence [-]
    eta : index of refraction relative to air [-]
    use_photon_table : whether to invert a table of Monte Carlo results, if one exists, instead of layered
        diffusion
    """
    from scipy.optimize import brentq

    kind = half_space_kind_for_eta(eta) if use_photon_table else None
    if kind is not None:
        return float(tabulated_albedo(kind, total_reflectance))

    def reflectance_excess(albedo: float) -> float:
        return (
            _reflectance_transform(
                _unit_mean_free_path_medium(albedo, eta), float(hankel.NEAR_ZERO_FREQUENCY[0])
            )
            - total_reflectance
        )

    if reflectance_excess(MIN_EQUIVALENT_ALBEDO) >= 0.0:
        return MIN_EQUIVALENT_ALBEDO
    return (
        float(brentq(reflectance_excess, MIN_EQUIVALENT_ALBEDO, MAX_EQUIVALENT_ALBEDO))
        if reflectance_excess(MAX_EQUIVALENT_ALBEDO) > 0.0
        else MAX_EQUIVALENT_ALBEDO
    )


def _unit_mean_free_path_medium(albedo: float, eta: float) -> Medium:
    """Return a half-space whose mean free path is 1 mm."""
    return Medium("half-space", (Layer(np.array([1.0 - albedo]), np.array([albedo])),), eta)


def _gaussian_transform(gaussians: tuple[tuple[float, float], ...], frequency: float) -> float:
    """Return the Hankel transform of a sum of Gaussians in one channel at a frequency [-].

    gaussians : variance [mm2] and weight of each Gaussian
    frequency : frequency s [1/mm]
    """
    return sum(weight * math.exp(-0.5 * variance * frequency**2) for variance, weight in gaussians)


def _cumulative_transform(cumulative_profile: CumulativeProfile, frequency: float) -> float:
    """Return the Hankel transform of a profile's first channel, relative to its value at frequency 0 [-].

    frequency : frequency s [1/mm]
    """
    from scipy.special import j0

    edges = cumulative_profile.radii_mm
    ring_radius = np.append(0.5 * edges[1], np.sqrt(edges[1:-1] * edges[2:]))
    return float(j0(frequency * ring_radius) @ np.diff(cumulative_profile.fraction[:, 0]))


def _reflectance_transform(medium: Medium, frequency: float) -> float:
    """Return the Hankel transform of R(r) of a half-space with one channel, at one frequency [-].

    frequency : frequency s [1/mm]
    """
    A = boundary_mismatch(medium.eta, "exact")
    return float(layered_diffusion.solve_reflectance(np.array([frequency]), medium, A)[0, 0])


def _half_frequency(hankel_transform: Callable[[float], float]) -> float:
    """Return the frequency at which a Hankel transform is half of its value at frequency 0 [1/mm].

    hankel_transform : function from a frequency to the Hankel transform, which decreases with frequency
    """
    from scipy.optimize import brentq

    total = hankel_transform(float(hankel.NEAR_ZERO_FREQUENCY[0]))
    excess = lambda log: hankel_transform(float(np.exp(log))) - 0.5 * total  # noqa: E731
    return float(np.exp(brentq(excess, *_LOG_FREQUENCY_RANGE)))


def oblique_offset_mm(medium: Medium) -> float:
    """Return the lateral shift of grazing light, as the mean over all channels [mm].

    The shift is the distance along the surface from the point where light enters to the mean point where it
    leaves. For light at an angle t to the normal, the shift is sin t times the shift of grazing light.

    medium : medium with one layer

    Source: [WangJacques1995].
    """
    layer = medium.layers[0]
    return float(
        np.mean(1.0 / (layer.sigma_s_prime + _ABSORPTION_WEIGHT_IN_OFFSET * layer.sigma_a)) / medium.eta
    )
