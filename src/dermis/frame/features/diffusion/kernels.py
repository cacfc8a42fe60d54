"""Gaussian kernels of exact variance at whole texels, and chains of blurs at falling resolution."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.diffusion.pyramid import SHARP, halvings_of

Floats = NDArray[np.float64]
ROWS_PER_UNIT = 64
WIDEST = 9
TRUNCATION = 3.3
"""Standard deviations at which a Gaussian is cut off."""
SUMMED_TRUNCATION = 2.4
"""The same for a Gaussian that starts from a narrower one: the cut keeps its variance, and the next blur
smooths what it changes of the shape (0.014 % of an image at most)."""
NARROW = 1.5
"""Standard deviation up to which a Gaussian that starts from unblurred light may be cut off there [texel]."""
_MOST_TAPS = math.ceil(TRUNCATION * math.sqrt(WIDEST))
_BISECTIONS = 60
_WIDE_TRUNCATION, _SMOOTH = 4.0, 1.6  # as in diffuse.wgsl
_OTHER_READS = 5.0  # of a texel in one pass beside taps: how the map lies there, gutters, what is stored
_LEVEL = 2.0  # what a level costs whatever its size, in reads of every texel
_LEAST_SAVED = 0.25  # of a chain's cost: for less, a chain stays as it is
_PAST = 1.001  # of the variance that permits a halving, so that rounding does not forbid it
_EVEN = 1.0  # least deviation of a level between in its own texels: a point of light keeps its place
_APART = 1.5  # variances that are nearer are one level


def taps(variance: float, truncation: float = TRUNCATION) -> int:
    """Taps on each side for a variance in units of the step squared."""
    return math.ceil(truncation * math.sqrt(variance))


@cache
def kernel_table() -> NDArray[np.float32]:
    """q = w(1) / w(0) of the kernel w(n) = q^(n^2): rows by variance (1/64 step^2), columns by taps a side.

    A Gaussian that is sampled and cut off loses variance, a narrow one most of it. So q is solved for each
    number of taps such that the kernel has the requested variance.
    """
    variance = np.arange(WIDEST * ROWS_PER_UNIT + 2)[:, None] / ROWS_PER_UNIT
    n = np.arange(_MOST_TAPS + 1)
    inside = n[None, :] <= n[:, None]  # column of the table, tap
    low, high = np.zeros((len(variance), len(n))), np.ones((len(variance), len(n)))
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        narrow = _variance(middle, inside) < variance
        low, high = np.where(narrow, middle, low), np.where(narrow, high, middle)
    return (0.5 * (low + high)).astype(np.float32)


def kernel(variance: float, truncation: float = TRUNCATION) -> Floats:
    """(2 taps + 1,) normalised weights for a variance in units of the step squared."""
    reach = taps(variance, truncation)
    row = variance * ROWS_PER_UNIT
    low, high = kernel_table().astype(np.float64)[[int(row), int(row) + 1], reach]
    n = np.arange(-reach, reach + 1)
    weights = (low + (high - low) * (row % 1.0)) ** (n**2)
    return np.asarray(weights / weights.sum())


def _variance(q: Floats, inside: NDArray[np.bool_]) -> Floats:
    n2 = np.arange(inside.shape[1], dtype=np.float64) ** 2
    with np.errstate(under="ignore"):
        weights = np.where(inside, q[..., None] ** n2, 0.0)
    variance: Floats = 2.0 * (weights @ n2) / (2.0 * weights.sum(axis=-1) - 1.0)
    return variance


def lead_up(
    variance_mm2: NDArray[np.float64], texels_per_mm: float, most: int
) -> tuple[NDArray[np.float64], tuple[int, ...]]:
    """Variances with those between that make the chain cheaper, and which of them are between [mm^2].

    variance_mm2 : of the profile's levels, increasing
    texels_per_mm : of the map
    most : how often the resolution may be halved

    A level between is just wide enough that the next may have half the resolution, by the rule of
    `halvings_of`, and at least as wide as its texels.
    """
    wanted = tuple(float(v) for v in variance_mm2)
    return _lead_up(wanted, float(texels_per_mm), most)


@cache
def _lead_up(
    wanted: tuple[float, ...], texels_per_mm: float, most: int
) -> tuple[NDArray[np.float64], tuple[int, ...]]:
    chosen = list(wanted)
    sides = [2.0**times / texels_per_mm for times in range(most)]  # [mm]
    permits = [_PAST * max(SHARP * (2.0 * side) ** 2, _EVEN * side) ** 2 for side in sides]
    least = chain_cost(chosen, texels_per_mm, most)
    for between in permits:
        if between >= wanted[-1] or any(between < _APART * v and v < _APART * between for v in chosen):
            continue
        tried = sorted({*chosen, between})
        cost = chain_cost(tried, texels_per_mm, most)
        if cost < (1.0 - _LEAST_SAVED) * least:
            chosen, least = tried, cost
    steps = tuple(k for k, v in enumerate(chosen, start=1) if v not in wanted)
    return np.array(chosen), steps


def chain_cost(variance_mm2: list[float], texels_per_mm: float, most: int) -> float:
    """About how many texels of the whole resolution a chain reads for each that it makes."""
    halvings = halvings_of(np.array(variance_mm2), texels_per_mm, most)
    cost = 0.0
    for (before, after), halved in zip(pairwise([0.0, *variance_mm2]), halvings[1:], strict=True):
        per_mm2 = (texels_per_mm / 2.0**halved) ** 2
        step = max(1.0, math.floor(math.sqrt(min(_SMOOTH**2 * before, after - before) * per_mm2)))
        scaled = (after - before) * per_mm2 / step**2
        reach = taps(scaled, _WIDE_TRUNCATION if scaled > WIDEST else SUMMED_TRUNCATION)
        cost += 2.0 * (2.0 * reach + 1.0 + _OTHER_READS) / 4.0**halved + _LEVEL
    return cost
