"""Kernels before the pair search: the surface that texels show, and the patches that may have pairs."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.translucency.kernels.pair_search import ASKEW
from dermis.machine_code import compiled

_INSIDE = 0.1  # texels; the place of a texel beside a chart is on its edge, or in another chart
Doubles = NDArray[np.float64]
Integers = NDArray[np.int64]
_ACROSS = math.sqrt(1.0 - ASKEW**2)
_ROUNDING = 1e-6  # of cosines


@compiled
def places(
    triangle: NDArray[np.int32], barycentric: NDArray[np.uint16], corner: NDArray[np.float32]
) -> tuple[NDArray[np.int16], NDArray[np.bool_]]:
    """(n, n, 2) texel nearest the place that each shows, x and y from -1 to n; (n, n) whether it is its own.

    triangle, barycentric, corner : as `Atlas` has them, the last by the name `place`
    """
    size = len(triangle)
    nearest = np.full((size, size, 2), -1, np.int16)
    inside = np.zeros((size, size), np.bool_)
    at = np.empty(2, np.float64)
    for y in range(size):
        for x in range(size):
            t = triangle[y, x]
            if t < 0:
                continue
            b, c = barycentric[y, x, 0] / 65535.0, barycentric[y, x, 1] / 65535.0
            for k in range(2):
                first = np.float64(corner[t, 0, k])
                along = b * (np.float64(corner[t, 1, k]) - first) + c * (np.float64(corner[t, 2, k]) - first)
                at[k] = (first + along) * size - 0.5
                nearest[y, x, k] = np.int16(min(max(np.rint(at[k]), -1.0), size))
            inside[y, x] = max(abs(at[0] - x), abs(at[1] - y)) < _INSIDE
    return nearest, inside


class Patches(NamedTuple):
    """Groups of triangles that are near each other.

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
    """A grid whose cells list the patches that overlap them."""

    low: Doubles
    cell_mm: float
    size: Integers
    first: Integers
    listed: Integers


@compiled
def face(patches: Patches, cells: Cells, radius_mm: float) -> NDArray[np.bool_]:
    """(p,) whether each patch has another near enough whose normals may be far enough from its own."""
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
    """Whether normals of two patches may differ by enough for a pair."""
    cos_i, cos_j, sin_i, sin_j = patches.cosine[i], patches.cosine[j], patches.sine[i], patches.sine[j]
    cosine, sine = cos_i * cos_j - sin_i * sin_j, sin_i * cos_j + cos_i * sin_j  # of both angles together
    if cosine <= ASKEW or sine < 0.0:
        return True
    between = 0.0
    for k in range(3):
        between += patches.axis[i, k] * patches.axis[j, k]
    # both cones of normals may narrow the angle between the axes
    return bool(between <= ASKEW * cosine + _ACROSS * sine + _ROUNDING)


@compiled
def _square_mm2(i: int, j: int, patches: Patches) -> float:
    """The square of the distance between two boxes."""
    square = 0.0
    for k in range(3):
        gap = max(0.0, patches.low[i, k] - patches.high[j, k], patches.low[j, k] - patches.high[i, k])
        square += gap * gap
    return square
