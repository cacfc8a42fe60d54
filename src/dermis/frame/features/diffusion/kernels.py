"""Discrete Gaussian kernels with exact variance, and chains of blurs at decreasing resolution."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.diffusion.pyramid import MIN_SIGMA_PER_TEXEL_AREA, choose_halvings

Floats = NDArray[np.float64]
ROWS_PER_UNIT_VARIANCE = 64
"""Number of rows of the kernel table per unit of variance."""
MAX_TABLE_VARIANCE = 9
"""Largest variance in the kernel table, in units of the squared distance between taps."""
KERNEL_TRUNCATION_SIGMAS = 3.3
"""Half-width of a kernel in standard deviations, unless `CHAINED_TRUNCATION_SIGMAS` applies."""
CHAINED_TRUNCATION_SIGMAS = 2.4
"""Half-width of a kernel whose source is already blurred, in standard deviations.

The kernel still has the exact variance, and the next blur smooths its truncated shape: the truncation changes
an image by at most 0.014 %.
"""
MAX_CHAINED_SIGMA_TEXELS = 1.5
"""Standard deviation up to which `CHAINED_TRUNCATION_SIGMAS` also suits blurs of unblurred light [texel]."""
_MAX_TAPS_PER_SIDE = math.ceil(KERNEL_TRUNCATION_SIGMAS * math.sqrt(MAX_TABLE_VARIANCE))
_KERNEL_BISECTION_COUNT = 60
_WIDE_TRUNCATION_SIGMAS, _MAX_TAP_STEP_TEXELS = 4.0, 1.6  # as in diffuse.wgsl
_FIXED_READS_PER_PASS = 5.0  # texel reads of a pass besides its taps: stretch map, gutters, the result
_FIXED_READS_PER_LEVEL = 2.0  # fixed cost of a level, in reads per texel of the full resolution
_MIN_SAVED_COST_FRACTION = 0.25  # fraction of the cost that an intermediate level has to save
_HALVING_VARIANCE_MARGIN = 1.001  # factor of the variance that permits a halving, against rounding
_MIN_LEVEL_SIGMA_TEXELS = 1.0  # least standard deviation of an intermediate level, in its own texels
_MIN_VARIANCE_RATIO = 1.5  # least ratio of the variances of an intermediate level and any other


def taps_per_side(variance: float, truncation_sigmas: float = KERNEL_TRUNCATION_SIGMAS) -> int:
    """Return the number of taps of a Gaussian kernel on each side of its centre.

    variance : variance of the kernel, in units of the squared distance between taps
    truncation_sigmas : half-width of the kernel in standard deviations
    """
    return math.ceil(truncation_sigmas * math.sqrt(variance))


@cache
def kernel_ratio_table() -> NDArray[np.float32]:
    """Return a table of the ratio q for which the kernel w(n) = q^(n^2) has a given variance [-].

    w(n) is the weight of the n-th tap on either side of the centre, so q = w(1) / w(0). Row i of the table is
    for a variance of i / 64, in units of the squared distance between taps. Column j is for a kernel with j
    taps on each side of the centre.

    A sampled and truncated Gaussian has a smaller variance than the Gaussian. Therefore q is determined
    numerically, such that the truncated kernel has exactly the desired variance.
    """
    variance = np.arange(MAX_TABLE_VARIANCE * ROWS_PER_UNIT_VARIANCE + 2) / ROWS_PER_UNIT_VARIANCE
    columns = [_weight_ratios(variance, taps) for taps in range(_MAX_TAPS_PER_SIDE + 1)]
    return np.stack(columns, axis=1).astype(np.float32)


def _weight_ratios(variance: Floats, taps_on_a_side: int) -> Floats:
    """Return the ratio w(1) / w(0) of the kernels with the given variances, found by bisection."""
    low, high = np.zeros(len(variance)), np.ones(len(variance))
    with np.errstate(under="ignore"):
        for _ in range(_KERNEL_BISECTION_COUNT):
            middle = 0.5 * (low + high)
            too_narrow = _kernel_variance(middle, taps_on_a_side) < variance
            low, high = np.where(too_narrow, middle, low), np.where(too_narrow, high, middle)
    return 0.5 * (low + high)


def _kernel_variance(weight_ratio: Floats, taps_on_a_side: int) -> Floats:
    """Return the variances of the kernels w(n) = q^(n^2) with the given ratios q = w(1) / w(0)."""
    total, second_moment = np.ones_like(weight_ratio), np.zeros_like(weight_ratio)
    weight, factor, squared = np.ones_like(weight_ratio), weight_ratio, weight_ratio**2
    for n in range(1, taps_on_a_side + 1):
        weight, factor = weight * factor, factor * squared  # q^(n^2) and q^(2n + 1)
        total += 2.0 * weight
        second_moment += 2.0 * n**2 * weight
    return second_moment / total


def add_intermediate_levels(
    variance_mm2: NDArray[np.float64], texels_per_mm: float, max_halvings: int
) -> tuple[NDArray[np.float64], tuple[int, ...]]:
    """Insert levels into a chain of blurs, so that the chain needs fewer texel reads.

    Return the variances of all levels [mm^2], and the indices of the inserted levels. In the chain, each
    level is computed by blurring the previous level; level 0 is the unblurred light. An inserted level is
    blurred just enough for `choose_halvings` to halve the resolution of the next level.

    variance_mm2 : (k,) increasing variances of the profile's Gaussians, one level for each [mm^2]
    texels_per_mm : texel density of the atlas at full resolution
    max_halvings : largest number of times that the resolution may be halved
    """
    profile_mm2 = tuple(float(v) for v in variance_mm2)
    return _cached_intermediate_levels(profile_mm2, float(texels_per_mm), max_halvings)


@cache
def _cached_intermediate_levels(
    profile_variances_mm2: tuple[float, ...], texels_per_mm: float, max_halvings: int
) -> tuple[NDArray[np.float64], tuple[int, ...]]:
    chain = list(profile_variances_mm2)
    min_cost = blur_chain_cost(chain, texels_per_mm, max_halvings)
    for side in (2.0**times / texels_per_mm for times in range(max_halvings)):  # side of a texel
        level_mm2 = (
            _HALVING_VARIANCE_MARGIN
            * max(MIN_SIGMA_PER_TEXEL_AREA * (2.0 * side) ** 2, _MIN_LEVEL_SIGMA_TEXELS * side) ** 2
        )
        if level_mm2 >= profile_variances_mm2[-1]:
            continue
        if any(level_mm2 < _MIN_VARIANCE_RATIO * v and v < _MIN_VARIANCE_RATIO * level_mm2 for v in chain):
            continue
        candidate = sorted({*chain, level_mm2})
        cost = blur_chain_cost(candidate, texels_per_mm, max_halvings)
        if cost < (1.0 - _MIN_SAVED_COST_FRACTION) * min_cost:
            chain, min_cost = candidate, cost
    intermediate_levels = tuple(k for k, v in enumerate(chain, start=1) if v not in profile_variances_mm2)
    return np.array(chain), intermediate_levels


def blur_chain_cost(variance_mm2: list[float], texels_per_mm: float, max_halvings: int) -> float:
    """Estimate the number of texel reads of a chain of blurs, per texel of the full resolution.

    variance_mm2 : increasing variances of the levels [mm^2]
    texels_per_mm : texel density of the atlas at full resolution
    max_halvings : largest number of times that the resolution may be halved
    """
    halvings = choose_halvings(np.array(variance_mm2), texels_per_mm, max_halvings)
    cost = 0.0
    for (before, after), halved in zip(pairwise([0.0, *variance_mm2]), halvings[1:], strict=True):
        per_mm2 = (texels_per_mm / 2.0**halved) ** 2
        step = max(
            1.0, math.floor(math.sqrt(min(_MAX_TAP_STEP_TEXELS**2 * before, after - before) * per_mm2))
        )
        scaled = (after - before) * per_mm2 / step**2
        reach = taps_per_side(
            scaled, _WIDE_TRUNCATION_SIGMAS if scaled > MAX_TABLE_VARIANCE else CHAINED_TRUNCATION_SIGMAS
        )
        cost += 2.0 * (2.0 * reach + 1.0 + _FIXED_READS_PER_PASS) / 4.0**halved + _FIXED_READS_PER_LEVEL
    return cost
