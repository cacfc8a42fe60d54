"""What texels show, and how far runs of texels go without a gap on the surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.machine_code import compiled


@compiled
def runs(
    chart: NDArray[np.int32],
    points: NDArray[np.float32],
    roots: NDArray[np.float32],
    metric: NDArray[np.float32],
    steps: float,
    slack_mm: float,
    reach: NDArray[np.uint16],
) -> None:
    """Fill reach (h, w, 4): texels to the left, right, up and down of the same chart without a gap.

    points : (h, w, 3) what each texel shows [mm]
    roots : (h, w, 2) nearest place on its chart [texel]
    metric : (h, w, 3) texels per mm along u and v, and a third number
    steps, slack_mm : neighbours have a gap between them if their points are farther apart than so many of
        their steps on the surface plus the slack, and their roots farther apart than either texel is from its
        root
    """
    height, width = chart.shape
    for y in range(height):
        for x in range(width):
            if x > 0 and chart[y, x] >= 0 and chart[y, x - 1] == chart[y, x]:
                limit = steps / max(min(metric[y, x, 0], metric[y, x - 1, 0]), 1e-6) + slack_mm
                if not (_apart(points[y, x], points[y, x - 1], limit) and _opposed(roots, y, x, y, x - 1)):
                    reach[y, x, 0] = reach[y, x - 1, 0] + 1
            if y > 0 and chart[y, x] >= 0 and chart[y - 1, x] == chart[y, x]:
                limit = steps / max(min(metric[y, x, 1], metric[y - 1, x, 1]), 1e-6) + slack_mm
                if not (_apart(points[y, x], points[y - 1, x], limit) and _opposed(roots, y, x, y - 1, x)):
                    reach[y, x, 2] = reach[y - 1, x, 2] + 1
    for y in range(height - 1, -1, -1):
        for x in range(width - 1, -1, -1):
            if x + 1 < width and reach[y, x + 1, 0] > 0:
                reach[y, x, 1] = reach[y, x + 1, 1] + 1
            if y + 1 < height and reach[y + 1, x, 2] > 0:
                reach[y, x, 3] = reach[y + 1, x, 3] + 1


@compiled
def _apart(a: Any, b: Any, limit: float) -> bool:
    return bool((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2 > limit * limit)


@compiled
def _opposed(roots: Any, y: int, x: int, other_y: int, other_x: int) -> bool:
    """Whether the roots of two texels are farther apart than either texel is from its root."""
    one, other = roots[y, x], roots[other_y, other_x]
    away = max((one[0] - x) ** 2 + (one[1] - y) ** 2, (other[0] - other_x) ** 2 + (other[1] - other_y) ** 2)
    return bool((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2 > away)


@compiled
def read(
    triangle: NDArray[np.int32],
    weights: NDArray[np.float32],
    corners: NDArray[np.float64],
    values: NDArray[np.float32],
) -> None:
    """Fill values (h, w, c) with what triangles have at their corners (f, 3, c), where there is one."""
    for y in range(triangle.shape[0]):
        for x in range(triangle.shape[1]):
            f = triangle[y, x]
            if f < 0:
                continue
            second, third = weights[y, x]
            for k in range(corners.shape[2]):
                first = 1.0 - second - third
                values[y, x, k] = (
                    first * corners[f, 0, k] + second * corners[f, 1, k] + third * corners[f, 2, k]
                )
