"""Which texels lie in triangles, and which place on a border each texel beyond them is nearest to."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.machine_code import compiled

_EDGE = 1e-6  # texels this near outside an edge count as on it
_WELL = 1e-3  # texels this far from an edge are on no other triangle that only shares it
Doubles = NDArray[np.float64]
_TEXEL = 1.001  # a texel, and what rounding may add


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


@compiled
def nearest_side(
    ends: Doubles,
    along_u: Doubles,
    along_v: Doubles,
    reach_mm: Doubles,
    widest: Doubles,
    owner: NDArray[np.int32],
    side: NDArray[np.int32],
    share: NDArray[np.float32],
    away_mm2: NDArray[np.float32],
    rim: NDArray[np.bool_],
) -> None:
    """For each texel near a border and outside: the nearest side, by the metric that the surface has there.

    ends : (k, 2, 2) of the border's sides [texel]
    along_u, along_v : (k, 2, 2) step on the surface, at both ends, for a texel to the right and down [mm]
    reach_mm : (k,) how far from each side its texels may lie [mm]
    widest : (k,) and how far at most [texel]
    owner : (h, w) triangles, -1 outside
    side, share, away_mm2 : (h, w) nearest side, how far along it from 0 to 1, squared distance, to be written
    rim : (h, w) texels that interpolation at some place on a border reads, to be written
    """
    height, width = owner.shape
    for k in range(len(ends)):
        e, f, g = _metric(along_u[k], along_v[k])
        limit = reach_mm[k] * reach_mm[k]
        det = max(e * g - f * f, 1e-9 * e * g, 1e-30)
        half_x = max(min(reach_mm[k] * math.sqrt(g / det), widest[k]), _TEXEL)
        half_y = max(min(reach_mm[k] * math.sqrt(e / det), widest[k]), _TEXEL)
        ax, ay, bx, by = ends[k, 0, 0], ends[k, 0, 1], ends[k, 1, 0], ends[k, 1, 1]
        sx, sy = bx - ax, by - ay
        length = max(e * sx * sx + 2 * f * sx * sy + g * sy * sy, 1e-30)
        for y in range(
            max(math.ceil(min(ay, by) - half_y), 0), min(int(max(ay, by) + half_y), height - 1) + 1
        ):
            for x in range(
                max(math.ceil(min(ax, bx) - half_x), 0), min(int(max(ax, bx) + half_x), width - 1) + 1
            ):
                if owner[y, x] >= 0:
                    continue
                qx, qy = x - ax, y - ay
                t = (e * qx * sx + f * (qx * sy + qy * sx) + g * qy * sy) / length
                t = min(max(t, 0.0), 1.0)
                vx, vy = qx - t * sx, qy - t * sy
                away = e * vx * vx + 2 * f * vx * vy + g * vy * vy
                read = _within_a_texel(qx, qy, sx, sy)
                rim[y, x] |= read
                if away < away_mm2[y, x] and (read or away < limit):
                    side[y, x], share[y, x], away_mm2[y, x] = k, t, away


@compiled
def _metric(along_u: Any, along_v: Any) -> tuple[float, float, float]:
    """Squared length and scalar product of a side's two steps, the mean of both ends."""
    ux, uy = (along_u[0, 0] + along_u[1, 0]) / 2, (along_u[0, 1] + along_u[1, 1]) / 2
    vx, vy = (along_v[0, 0] + along_v[1, 0]) / 2, (along_v[0, 1] + along_v[1, 1]) / 2
    return ux * ux + uy * uy, ux * vx + uy * vy, vx * vx + vy * vy


@compiled
def _within_a_texel(qx: float, qy: float, sx: float, sy: float) -> bool:
    """Whether some place q - t s is less than a texel from 0, along both axes."""
    first, last = 0.0, 1.0
    for q, s in ((qx, sx), (qy, sy)):
        if abs(s) < 1e-12:
            if abs(q) >= _TEXEL:
                return False
        else:
            one, other = (q - _TEXEL) / s, (q + _TEXEL) / s
            first, last = max(first, min(one, other)), min(last, max(one, other))
    return first <= last
