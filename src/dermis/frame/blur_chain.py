"""Levels of blur that only lead to others: a wide Gaussian is cheaper in steps of falling resolution."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dermis.frame.gaussian_kernels import SUMMED_TRUNCATION, WIDEST, taps
from dermis.frame.levels import SHARP, halvings_of

_WIDE_TRUNCATION, _SMOOTH = 4.0, 1.6  # as in diffuse.wgsl
_OTHER_READS = 5.0  # of a texel in one pass beside taps: how the map lies there, gutters, what is stored
_LEVEL = 2.0  # what a level costs whatever its size, in reads of every texel
_LEAST_SAVED = 0.25  # of a chain's cost: for less, a chain stays as it is
_PAST = 1.001  # of the variance that permits a halving, so that rounding does not forbid it
_EVEN = 1.0  # least deviation of a level between in its own texels: a point of light keeps its place
_APART = 1.5  # variances that are nearer are one level


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
