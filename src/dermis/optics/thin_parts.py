"""Light through thin parts of the body, such as ears: weights of Gaussians as functions of the thickness."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.optics.angular_response import (
    CACHED_COLUMN_COUNT,
    DIRECTION_ROWS,
    interpolate_columns,
    interpolate_table,
    refracted_cosine,
)
from dermis.optics.diffusion import hankel
from dermis.optics.diffusion.boundary import boundary_mismatch
from dermis.optics.diffusion.layered_diffusion import solve_homogeneous_slabs
from dermis.optics.equivalent_medium import (
    MAX_EQUIVALENT_ALBEDO,
    MIN_EQUIVALENT_ALBEDO,
    albedo_for_total_reflectance,
)
from dermis.optics.media import Layer, Medium
from dermis.optics.slabs import (
    DEEP_OPTICAL_DEPTH,
    DIRECTION_NODE_COUNT,
    Slabs,
    solve_doubled_slabs,
    solve_slabs,
)

Floats = NDArray[np.float64]
THICKNESS_ROWS = 32
"""Number of thicknesses of the tables in `ThinParts`."""
_DEEP_SLAB_OPTICAL_DEPTH = (
    10.0  # thickness beyond which relative transmittance by direction is constant [mean free paths]
)
_DIRECTION_NODE_COUNT = 8  # number of discrete directions for uniform light
# Thickness of the thinnest slabs that are solved [mean free paths], and how often they are doubled.
_MIN_OPTICAL_DEPTHS, _DOUBLING_COUNT = 1e-4 * np.array([1.0, 2.0**0.5]), 25
_OPTICAL_DEPTHS = (_MIN_OPTICAL_DEPTHS * 2.0 ** np.arange(_DOUBLING_COUNT + 1)[:, None]).ravel()
_MIN_TRANSMITTANCE = 1e-300  # replaces the transmittance 0 of thick black slabs in divisions
_FIT_FREQUENCIES = np.geomspace(
    0.02, 5.0, 24
)  # at which Gaussians are fitted to a profile [1/mean free path]


@dataclass(frozen=True, eq=False)
class ThinParts:
    """Light transmitted by thin parts of the body, and reflectance lost there, as functions of the thickness.

    Row 0 of each array is for the thickness 0, and the last row for `max_thickness_mm`; the square roots of
    the thicknesses are evenly spaced. The light is given as weights of k Gaussians in 3 channels, relative to
    the reflectance of a half-space of the medium.

    max_thickness_mm : largest thickness [mm]
    transmitted : (THICKNESS_ROWS, k, 3) weights of the light that leaves on the far side [-]
    lost : (THICKNESS_ROWS, k, 3) weights of the light that a half-space would reflect but the thin part does
        not; lost light spreads as widely as transmitted light [-]
    directionality : (THICKNESS_ROWS,) how strongly the transmittance depends on the incident direction: 0 for
        no dependence, 1 for the dependence of optically thick slabs (see `oblique_transmittance`) [-]
    """

    max_thickness_mm: float
    transmitted: Floats
    lost: Floats
    directionality: Floats


def solve_thin_parts(
    medium: Medium, variance_mm2: Floats, max_thickness_mm: float, g: float = 0.0
) -> ThinParts:
    """Return the light that slabs transmit, and the light that a half-space reflects but the slabs do not.

    The slabs consist of a medium with one layer; their thicknesses range from 0 to `max_thickness_mm`.

    medium : the medium, with reduced coefficients: scattering is already multiplied by 1 - g
    variance_mm2 : (k,) variances of the Gaussians that spread light [mm2]
    max_thickness_mm : largest thickness [mm]
    g : mean cosine of the scattering angle [-]

    The transmitted power is exact for uniform light. The spread of the light is that of layered diffusion at
    normal incidence.

    Sources: [Chandrasekhar1960] for the power, [Kienle1998] for the spread.
    """
    thickness_mm = max_thickness_mm * np.linspace(0.0, 1.0, THICKNESS_ROWS) ** 2
    transmitted, lost = np.zeros((2, THICKNESS_ROWS, len(variance_mm2), medium.channels))
    directionality, weight = np.zeros((2, THICKNESS_ROWS, medium.channels))
    for c, response in enumerate(_uniform_light_responses(medium.layers[0], thickness_mm[1:], medium.eta, g)):
        spread = _spread_weights(medium.channel(c), thickness_mm[1:], variance_mm2)
        transmitted[1:, :, c] = response.relative_transmittance[:, None] * spread
        lost[1:, :, c] = response.lost[:, None] * spread
        directionality[1:, c], weight[1:, c] = response.directionality, response.transmittance
        lost[0, :, c] = spread[0]
    directionality[0], weight[0] = directionality[1], weight[1]
    mean = (weight * directionality).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-12)
    return ThinParts(max_thickness_mm, transmitted, lost, np.clip(mean, -1.0, 1.0))


def oblique_transmittance(
    total_reflectance: Floats, eta: float, use_photon_table: bool = False, g: float = 0.0
) -> Floats:
    """Return the relative transmittance (DIRECTION_ROWS, c) of optically thick slabs by direction [-].

    The relative transmittance is t / r. Here, t is the slab's transmittance for the incident direction,
    divided by its transmittance for uniform light. The divisor r is the reflectance of a half-space for this
    direction, divided by its reflectance for uniform light. The square roots of the cosines of incidence in
    air are evenly spaced from 0 to 1.

    total_reflectance : (c,) reflectance of the half-space for light at normal incidence [-]
    eta : index of refraction relative to air [-]
    use_photon_table : whether the albedo for this reflectance comes from a table of Monte Carlo results, if
        one exists, instead of layered diffusion
    g : mean cosine of the scattering angle [-]
    """
    return interpolate_columns(
        partial(_oblique_transmittance_column, eta, use_photon_table, g), total_reflectance
    )


@lru_cache(maxsize=CACHED_COLUMN_COUNT)
def _oblique_transmittance_column(
    eta: float, use_photon_table: bool, g: float, total_reflectance: float
) -> Floats:
    cosine = refracted_cosine(np.linspace(0.0, 1.0, DIRECTION_ROWS) ** 2, eta)
    half_space, relative = _deep_transmittance(
        albedo_for_total_reflectance(total_reflectance, eta, use_photon_table), eta, DIRECTION_NODE_COUNT, g
    )
    return np.interp(cosine, half_space.cosine, relative)


def _deep_transmittance(
    albedo: float, eta: float, direction_node_count: int, g: float
) -> tuple[Slabs, Floats]:
    """Return the reflection of a half-space, and the relative transmittance (m,) of thick slabs [-].

    Both are for m incident directions. Relative transmittance is defined as in `oblique_transmittance`.

    albedo, eta, direction_node_count, g : as in `solve_slabs`
    """
    half_space = solve_slabs(albedo, DEEP_OPTICAL_DEPTH, eta, direction_node_count, g)
    deep = solve_slabs(albedo, _DEEP_SLAB_OPTICAL_DEPTH, eta, direction_node_count, g)
    return half_space, _relative_transmittance(deep, half_space)[0]


def _relative_transmittance(slabs: Slabs, half_space: Slabs) -> Floats:
    """Return the relative transmittance (n, m) of n slabs for m directions [-].

    It is defined as in `oblique_transmittance`.
    """
    reflected = half_space.reflected[0] / (half_space.reflected @ half_space.flux)
    transmitted = np.maximum(slabs.transmitted @ slabs.flux, _MIN_TRANSMITTANCE)[:, None]
    return np.asarray(slabs.transmitted / transmitted / reflected)


class _UniformLightResponse(NamedTuple):
    """Transmittance and lost reflectance of n slabs in one channel under uniform light.

    transmittance : (n,) transmitted fraction of the power that enters [-]
    relative_transmittance : (n,) transmittance divided by the reflectance of the half-space [-]
    lost : (n,) reflectance that is lost due to the finite thickness, divided by the reflectance of the
        half-space [-]
    directionality : (n,) dependence of the transmittance on the incident direction, see `ThinParts` [-]
    """

    transmittance: Floats
    relative_transmittance: Floats
    lost: Floats
    directionality: Floats


def _uniform_light_responses(
    layer: Layer, thickness_mm: Floats, eta: float, g: float
) -> Iterator[_UniformLightResponse]:
    """Yield the `_UniformLightResponse` of each channel for slabs of n thicknesses.

    The responses are computed once for the optical thicknesses `_OPTICAL_DEPTHS`, and interpolated between
    these by cubic splines.

    layer : medium of the slabs, with reduced coefficients; its field `thickness_mm` is ignored
    thickness_mm : (n,) thicknesses of the slabs [mm]
    eta : index of refraction relative to air [-]
    g : mean cosine of the scattering angle [-]
    """
    from scipy.interpolate import CubicSpline

    roots = np.sqrt(1.0 - layer.alpha_prime).tolist()
    columns = [interpolate_table(partial(_uniform_light_response_column, eta, g), root) for root in roots]
    spline = CubicSpline(np.log(_OPTICAL_DEPTHS), np.stack(columns, axis=1))
    for c, extinction in enumerate(layer.sigma_t_prime.tolist()):
        depth = np.clip(extinction * thickness_mm, _OPTICAL_DEPTHS[0], _OPTICAL_DEPTHS[-1])
        yield _UniformLightResponse(*spline(np.log(depth))[:, c].T)


@lru_cache(maxsize=CACHED_COLUMN_COUNT)
def _uniform_light_response_column(eta: float, g: float, sqrt_absorbed_fraction: float) -> Floats:
    """Return the fields of `_UniformLightResponse` as columns (n, 4), for one albedo and n optical depths.

    The optical depths are `_OPTICAL_DEPTHS`.

    eta : index of refraction relative to air [-]
    g : mean cosine of the scattering angle [-]
    sqrt_absorbed_fraction : square root of 1 minus the reduced albedo, the coordinate of the table [-]
    """
    albedo = min(max(1.0 - sqrt_absorbed_fraction**2, MIN_EQUIVALENT_ALBEDO), MAX_EQUIVALENT_ALBEDO)
    slabs = solve_doubled_slabs(albedo, _MIN_OPTICAL_DEPTHS, _DOUBLING_COUNT, eta, _DIRECTION_NODE_COUNT, g)
    half_space, deep = _deep_transmittance(albedo, eta, _DIRECTION_NODE_COUNT, g)
    reflectance, deep_change = half_space.reflected @ half_space.flux, deep - 1.0
    weight = half_space.flux * half_space.reflected[0]
    slab_change = _relative_transmittance(slabs, half_space) - 1.0
    directionality = slab_change @ (weight * deep_change) / (weight * deep_change**2).sum()
    transmittance = slabs.transmitted @ slabs.flux
    lost = np.maximum(1.0 - slabs.reflected @ slabs.flux / reflectance, 0.0)
    return np.stack([transmittance, transmittance / reflectance, lost, directionality], axis=-1)


def _spread_weights(medium: Medium, thickness_mm: Floats, variance_mm2: Floats) -> Floats:
    """Return weights (n, k) of k Gaussians that fit the transmittance profiles of n slabs.

    The profiles are normalised, so the weights of each slab sum to 1.

    medium : medium with one layer; only its first channel is used
    thickness_mm : (n,) thicknesses of the slabs [mm]
    variance_mm2 : (k,) variances of the Gaussians [mm2]
    """
    from scipy.optimize import nnls

    layer, A, stiffness = medium.layers[0], boundary_mismatch(medium.eta, "exact"), 100.0
    s = _FIT_FREQUENCIES * float(layer.sigma_t_prime[0])
    frequency = np.concatenate([hankel.NEAR_ZERO_FREQUENCY, s])
    transform = solve_homogeneous_slabs(frequency, layer, thickness_mm, A)[1][..., 0]
    # the last row makes the weights sum to 1
    ones = np.full((1, len(variance_mm2)), stiffness)
    gaussians = np.vstack([np.exp(-0.5 * variance_mm2 * s[:, None] ** 2), ones])
    spread = transform[:, 1:] / np.maximum(transform[:, :1], _MIN_TRANSMITTANCE)
    weight = np.stack([nnls(gaussians, np.append(row, stiffness))[0] for row in spread])
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))
