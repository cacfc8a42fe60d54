"""Colours of exported hairs, reduced to a few groups of similar hairs."""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Doubles, Index
from dermis.mesh.strands import Strands

HAIR_COLOUR_COUNT = 64
"""Default number of groups."""
_HAIR_ALBEDO_EXPONENT = 5.89  # for fibres of roughness 0.3: [Chiang2016] equation 9


def grouped_colours(strands: Strands, count: int = HAIR_COLOUR_COUNT) -> tuple[Doubles, Index]:
    """Return the mean linear colours (count, 3) of groups of strands, and the group (n,) of each strand.

    Groups have equal sizes and are in the order of brightness, from dark to light.
    """
    albedo = hair_albedo(strands)
    order = np.argsort(albedo.sum(axis=1), kind="stable")
    group = np.empty(len(order), np.int64)
    group[order] = np.arange(len(order)) * count // len(order)
    sums = np.stack([np.bincount(group, albedo[:, c], count) for c in range(3)], axis=-1)
    return sums / np.maximum(np.bincount(group, minlength=count), 1)[:, None], group


def hair_albedo(strands: Strands) -> Doubles:
    """Return the linear colour (n, 3) that a bundle of parallel hairs like each of n strands has [-].

    Source: [Chiang2016] equation 9, at a roughness of 0.3.
    """
    absorbance = strands.absorption * strands.radius_mm.max(axis=1, keepdims=True)
    return np.asarray(np.exp(-_HAIR_ALBEDO_EXPONENT * np.sqrt(absorbance.astype(np.float64))))
