"""Which texels lie in triangles, and where in them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.machine_code import compiled

_EDGE = 1e-6  # texels this near outside an edge count as on it
_WELL = 1e-3  # texels this far from an edge are on no other triangle that only shares it


@compiled
def fill(places: NDArray[np.float64], triangles: NDArray[np.int64], owner: NDArray[np.int32]) -> None:
    """Write the number of each triangle into the texels whose centre lies in it; later ones win.

    places : (f, 3, 2) corners [texel]
    triangles : those to be drawn
    owner : (h, w) is written to
    """
    height, width = owner.shape
    for f in triangles:
        top, bottom = _rows(places[f])
        for y in range(max(math.ceil(top - _EDGE), 0), min(math.floor(bottom + _EDGE), height - 1) + 1):
            left, right = _span(places[f], y)
            for x in range(max(math.ceil(left - _EDGE), 0), min(math.floor(right + _EDGE), width - 1) + 1):
                owner[y, x] = f


@compiled
def count(
    places: NDArray[np.float64],
    triangles: NDArray[np.int64],
    owner: NDArray[np.int32],
    inside: NDArray[np.int64],
    owned: NDArray[np.int64],
) -> None:
    """Count the texels well inside each triangle, and those of them that it owns; arguments as for `fill`.

    inside, owned : (f,) are written to
    """
    height, width = owner.shape
    for f in triangles:
        top, bottom = _rows(places[f])
        for y in range(max(math.ceil(top + _WELL), 0), min(math.floor(bottom - _WELL), height - 1) + 1):
            left, right = _span(places[f], y)
            for x in range(max(math.ceil(left + _WELL), 0), min(math.floor(right - _WELL), width - 1) + 1):
                inside[f] += 1
                owned[f] += owner[y, x] == f


@compiled
def _rows(p: Any) -> tuple[float, float]:
    """Least and greatest height of the corners."""
    return min(p[0, 1], p[1, 1], p[2, 1]), max(p[0, 1], p[1, 1], p[2, 1])


@compiled
def _span(p: Any, y: int) -> tuple[float, float]:
    """Where row y enters and leaves the triangle."""
    left, right = math.inf, -math.inf
    for k in range(3):
        ax, ay = p[k]
        bx, by = p[(k + 1) % 3]
        low, high = min(ay, by), max(ay, by)
        if low - _EDGE <= y <= high + _EDGE:
            if high - low < _EDGE:
                left, right = min(left, ax, bx), max(right, ax, bx)
            else:
                x = ax + (bx - ax) * min(max((y - ay) / (by - ay), 0.0), 1.0)
                left, right = min(left, x), max(right, x)
    return left, right


@compiled
def weigh(places: NDArray[np.float64], owner: NDArray[np.int32], weights: NDArray[np.float32]) -> None:
    """Fill weights (h, w, 2) of the second and third corner at the centre of each texel that has an owner."""
    for y in range(owner.shape[0]):
        for x in range(owner.shape[1]):
            if owner[y, x] < 0:
                continue
            p = places[owner[y, x]]
            e1x, e1y = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1]
            e2x, e2y = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1]
            qx, qy = x - p[0, 0], y - p[0, 1]
            area = e1x * e2y - e1y * e2x
            second = min(max((qx * e2y - qy * e2x) / area, 0.0), 1.0)
            third = min(max((e1x * qy - e1y * qx) / area, 0.0), 1.0)
            total = max(second + third, 1.0)
            weights[y, x, 0], weights[y, x, 1] = second / total, third / total
