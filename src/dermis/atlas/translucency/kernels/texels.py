"""Where in the atlas the surface is that its texels show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.machine_code import compiled

_INSIDE = 0.1  # texels; the place of a texel beside a chart is on its edge, or in another chart


@compiled
def places(
    triangle: NDArray[np.int32], barycentric: NDArray[np.uint16], corner: NDArray[np.float32]
) -> tuple[NDArray[np.int16], NDArray[np.bool_]]:
    """(n, n, 2) the texel nearest what each shows, x and y from -1 to n, and (n, n) whether that is its own.

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
