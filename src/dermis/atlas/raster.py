"""Which texels of the uv map lie in which triangle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.mesh import Mesh

Floats = NDArray[np.float64]
Index = NDArray[np.int64]


def texel_corners(mesh: Mesh, size: int, triangle: NDArray[np.integer]) -> Floats:
    """(t, 3, 2) uv corners in texels, whole numbers at texel centres."""
    return np.asarray(mesh.uv[mesh.triangles[triangle]].astype(np.float64) * size - 0.5)


def rasterise(mesh: Mesh, size: int, triangle: NDArray[np.integer]) -> tuple[Index, Index]:
    """Texels whose centre lies in a triangle, as (flat texel index, triangle), by spans of rows."""
    p = texel_corners(mesh, size, triangle)
    top, bottom = _inside(p[:, :, 1].min(axis=1), p[:, :, 1].max(axis=1), size)
    which, y = _expand(top, np.maximum(bottom - top + 1, 0))
    left, right = _inside(*_span(p[which], y), size)
    span, x = _expand(left, np.maximum(right - left + 1, 0))
    return y[span] * size + x, triangle[which[span]].astype(np.int64)


def _inside(low: Floats, high: Floats, size: int) -> tuple[Index, Index]:
    """First and last whole number between two bounds, within 0 .. size - 1."""
    first = np.clip(np.ceil(low - 1e-6), 0, size).astype(np.int64)
    return first, np.clip(np.floor(high + 1e-6), -1, size - 1).astype(np.int64)


def _expand(first: Index, count: Index) -> tuple[Index, Index]:
    """Each run first, first + 1, ... of `count` numbers, with the index of the run it belongs to."""
    which = np.repeat(np.arange(len(count)), count)
    start = np.repeat(np.cumsum(count) - count, count)
    return which, np.arange(len(which)) - start + first[which]


def _span(p: Floats, y: Index) -> tuple[Floats, Floats]:
    """Where row y enters and leaves each triangle."""
    lowest = np.full(len(y), -np.inf)
    highest = np.full(len(y), np.inf)
    area = cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    sign = np.where(area >= 0, 1.0, -1.0)
    for k in range(3):
        a, edge = p[:, k], p[:, (k + 1) % 3] - p[:, k]
        # inside: cross(edge, q - a) * sign >= 0, linear in q.x with slope -edge.y * sign
        slope = -edge[:, 1] * sign
        level = (edge[:, 0] * (y - a[:, 1]) + edge[:, 1] * a[:, 0]) * sign
        crossing = -level / np.where(slope == 0, 1.0, slope)
        lowest = np.where(slope > 0, np.maximum(lowest, crossing), lowest)
        highest = np.where(slope < 0, np.minimum(highest, crossing), highest)
        highest = np.where((slope == 0) & (level < 0), -np.inf, highest)
    return np.where(np.isfinite(lowest), lowest, 1.0), np.where(np.isfinite(highest), highest, 0.0)


def cross(a: Floats, b: Floats) -> Floats:
    """z of the cross product of (..., 2) vectors."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
