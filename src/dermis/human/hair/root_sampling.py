"""Progressive blue-noise samples of a surface, and evenly spread thresholds by which they are thinned."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Mask

Index = NDArray[np.int64]

CANDIDATES_PER_SAMPLE = 4
"""Number of random points from which each sample is chosen."""
_RADIUS_RATIO = 0.67  # distance between samples, relative to the square root of the area of a sample
_COARSEST_COUNT = 500  # number of samples of the first level; each further level has twice as many
_GOLDEN_RATIO = 0.6180339887498949
_MORTON_CELL_MM, _MORTON_BITS = 0.5, 10


def progressive_samples(candidates_mm: Doubles, area_mm2: float, count: int) -> Index:
    """Return the indices of candidates that form a blue-noise sample, of which each prefix is blue noise too.

    Samples are accepted if their distance from all others is at least a radius that depends on the density.
    The radius decreases from level to level, and the samples of all levels together are kept [McCool1992].
    The result has fewer than `count` indices if the surface has no room for more.

    candidates_mm : (n, 3) random points of the surface, in random order [mm]
    area_mm2 : area of the surface [mm2]
    count : largest number of samples
    """
    from scipy.spatial import cKDTree

    accepted = np.zeros(0, np.int64)
    for target in _level_counts(count):
        radius_mm = _RADIUS_RATIO * float(np.sqrt(area_mm2 / target))
        pool = candidates_mm[: CANDIDATES_PER_SAMPLE * target]
        free = np.ones(len(pool), bool)
        if len(accepted):
            tree = cKDTree(candidates_mm[accepted], compact_nodes=False, balanced_tree=False)
            free = ~np.isfinite(tree.query(pool, distance_upper_bound=radius_mm)[0])
        index = np.flatnonzero(free)
        accepted = np.concatenate([accepted, index[_distant_points(pool[index], radius_mm)]])
    return accepted[:count]


def _level_counts(count: int) -> list[int]:
    """Return the numbers of samples of the levels, each twice that of the level before, up to `count`."""
    halvings = max(0, int(np.log2(max(count, 1) / _COARSEST_COUNT)))
    return [-(-count // 2**k) for k in range(halvings, -1, -1)] if count else []


def _distant_points(points_mm: Doubles, radius_mm: float) -> Mask:
    """Return a mask (n,) of points, accepted in order if no accepted point is within a radius."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(points_mm, compact_nodes=False, balanced_tree=False).query_pairs(
        radius_mm, output_type="ndarray"
    )
    first, second = pairs.min(axis=1), pairs.max(axis=1)
    undecided, accepted = np.ones(len(points_mm), bool), np.zeros(len(points_mm), bool)
    while len(first):
        blocked = ~undecided
        blocked[second] = True
        accepted |= ~blocked
        undecided &= blocked
        undecided[second[accepted[first]]] = False
        left = undecided[first] & undecided[second]
        first, second = first[left], second[left]
    return accepted | undecided


def spread_thresholds(samples_mm: Doubles) -> Doubles:
    """Return thresholds (n,), 0 to 1, that neighbouring samples do not share.

    The samples whose thresholds are less than a fraction are spread evenly over all of them. This also holds
    for the samples of each level of `progressive_samples`.

    samples_mm : (n, 3) samples in the order of `progressive_samples` [mm]
    """
    thresholds = np.empty(len(samples_mm))
    ends = [*_level_counts(len(samples_mm))]
    for begin, end in zip([0, *ends], ends, strict=False):
        order = np.argsort(_morton_codes(samples_mm[begin:end]), kind="stable")
        thresholds[begin + order] = np.modf((np.arange(end - begin) + 0.5) * _GOLDEN_RATIO)[0]
    return thresholds


def _morton_codes(points_mm: Doubles) -> Index:
    """Return the positions (n,) of points along a space-filling curve of 0.5 mm cells."""
    cells = np.floor((points_mm - points_mm.min(axis=0, initial=np.inf)) / _MORTON_CELL_MM).astype(np.int64)
    codes = np.zeros(len(points_mm), np.int64)
    for bit in range(_MORTON_BITS):
        for axis in range(3):
            codes |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return codes
