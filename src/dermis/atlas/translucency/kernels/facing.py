"""The search for patches of the surface that may have others across the flesh."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.translucency.kernels.pair_search import ASKEW
from dermis.machine_code import compiled

Doubles = NDArray[np.float64]
Integers = NDArray[np.int64]
_ACROSS = math.sqrt(1.0 - ASKEW**2)
_ROUNDING = 1e-6  # of cosines


class Patches(NamedTuple):
    """Triangles that are near each other.

    low, high : (p, 3) corners of a box around each patch [mm]
    axis : (p, 3) mean normal
    cosine, sine : (p,) of the widest angle between it and a normal
    """

    low: Doubles
    high: Doubles
    axis: Doubles
    cosine: Doubles
    sine: Doubles


class Cells(NamedTuple):
    """A grid whose cells list the patches that reach into them."""

    low: Doubles
    cell_mm: float
    size: Integers
    first: Integers
    listed: Integers


@compiled
def face(patches: Patches, cells: Cells, radius_mm: float) -> NDArray[np.bool_]:
    """(p,) whether a patch is near enough whose normals may be far enough from its own."""
    found = np.zeros(len(patches.low), np.bool_)
    for i in range(len(found)):
        found[i] = _faced(i, patches, cells, radius_mm)
    return found


@compiled
def _faced(i: int, patches: Patches, cells: Cells, radius_mm: float) -> bool:
    begin, end = np.empty(3, np.int64), np.empty(3, np.int64)
    for k in range(3):
        low, high = patches.low[i, k] - radius_mm, patches.high[i, k] + radius_mm
        begin[k] = max(0, math.floor((low - cells.low[k]) / cells.cell_mm))
        end[k] = min(cells.size[k], math.floor((high - cells.low[k]) / cells.cell_mm) + 1)
    for z in range(begin[2], end[2]):
        for y in range(begin[1], end[1]):
            row = cells.size[0] * (y + cells.size[1] * z)
            for q in range(cells.first[row + begin[0]], cells.first[row + end[0]]):
                j = cells.listed[q]
                if _askew(i, j, patches) and _square_mm2(i, j, patches) < radius_mm**2:
                    return True
    return False


@compiled
def _askew(i: int, j: int, patches: Patches) -> bool:
    """Whether normals of two patches may differ by so much that a place counts."""
    cos_i, cos_j, sin_i, sin_j = patches.cosine[i], patches.cosine[j], patches.sine[i], patches.sine[j]
    cosine, sine = cos_i * cos_j - sin_i * sin_j, sin_i * cos_j + cos_i * sin_j  # of both angles together
    if cosine <= ASKEW or sine < 0.0:
        return True
    between = 0.0
    for k in range(3):
        between += patches.axis[i, k] * patches.axis[j, k]
    # Both angles are taken off the one from which a place counts.
    return bool(between <= ASKEW * cosine + _ACROSS * sine + _ROUNDING)


@compiled
def _square_mm2(i: int, j: int, patches: Patches) -> float:
    """The square of the distance between two boxes."""
    square = 0.0
    for k in range(3):
        gap = max(0.0, patches.low[i, k] - patches.high[j, k], patches.low[j, k] - patches.high[i, k])
        square += gap * gap
    return square
