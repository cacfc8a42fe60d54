"""Which place on a border each texel beyond it is nearest to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.raster import expand_runs

Doubles = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]
_TEXEL = 1.001  # a texel, and what rounding may add


class BorderSides(NamedTuple):
    """The sides of a border on a grid.

    ends : (k, 2, 2) [texel]
    steps : (k, 2, 2, 2) on the surface, at both ends, for a texel to the right and for one down [mm]
    reach_mm : (k,) how far from each side its texels may lie
    widest : (k,) and how far at most [texel]
    """

    ends: Doubles
    steps: Doubles
    gutter_mm: Doubles
    max_texels: Doubles


class NearestPoints(NamedTuple):
    """Texels (n,) outside of pieces, and the place on a border that each is nearest to.

    texel : flat index
    side, share : number of the side, and how far along it, 0 to 1
    away_mm : distance by the metric that the surface has there
    rim : whether interpolation at some place on the border reads it
    """

    texel: Index
    side: Index
    share: Doubles
    distance_mm: Doubles
    rim: Flags


class _Metric(NamedTuple):
    """Of sides (k,): lengths and directions on the surface.

    x, y, down : a step by (dx, dy) texels is as long as one by (x dx + y dy, down dy) mm
    along : (k, 2) share of the side that a step by a texel goes along it
    half : (k, 2) how far texels within reach are from it at most [texel]
    """

    x: Doubles
    y: Doubles
    down: Doubles
    along: Doubles
    half: Doubles


def nearest_border_points(sides: BorderSides, inside: Flags) -> NearestPoints:
    """The nearest side of each texel within reach, by the metric that the surface has along the side.

    inside : (h, w) texels of pieces
    """
    metric = _metric(sides)
    k, x, y = _around(sides, metric, inside.shape)
    texel = y * inside.shape[1] + x
    outside = ~inside.ravel()[texel]
    k, x, y, texel = k[outside], x[outside], y[outside], texel[outside]
    off, along = np.stack((x, y)) - sides.ends[k, 0].T, np.diff(sides.ends, axis=1)[k, 0].T
    share = np.clip((metric.along[k].T * off).sum(axis=0), 0.0, 1.0)
    v = off - share * along
    away2 = (metric.x[k] * v[0] + metric.y[k] * v[1]) ** 2 + (metric.down[k] * v[1]) ** 2
    rim = _within_a_texel(off, along)
    near = np.flatnonzero(rim | (away2 < sides.gutter_mm[k] ** 2))
    least = np.full(inside.size, np.inf)
    np.minimum.at(least, texel[near], away2[near])
    first = np.full(inside.size, -1)
    best = near[away2[near] == least[texel[near]]][::-1]
    first[texel[best]] = best
    on_rim = np.zeros(inside.size, np.bool_)
    on_rim[texel[rim]] = True
    found = first[first >= 0]
    return NearestPoints(texel[found], k[found], share[found], np.sqrt(away2[found]), on_rim[texel[found]])


def _metric(sides: BorderSides) -> _Metric:
    u, v = np.moveaxis(sides.steps.mean(axis=1), 1, 0)
    e, f, g = (u * u).sum(axis=1), (u * v).sum(axis=1), (v * v).sum(axis=1)
    det = np.maximum(np.maximum(e * g - f * f, 1e-9 * e * g), 1e-30)
    reach = sides.gutter_mm * np.sqrt(np.stack((g, e)) / det)
    half = np.maximum(np.minimum(reach, sides.max_texels), _TEXEL).T
    x, y = (sides.ends[:, 1] - sides.ends[:, 0]).T
    length = np.maximum(e * x * x + 2 * f * x * y + g * y * y, 1e-30)
    along = np.column_stack((e * x + f * y, f * x + g * y)) / length[:, None]
    across = np.sqrt(np.maximum(e, 1e-30))
    return _Metric(across, f / across, np.sqrt(det) / across, along, half)


def _around(sides: BorderSides, metric: _Metric, shape: tuple[int, ...]) -> tuple[Index, Index, Index]:
    """Sides (n,) and all texels (n,), (n,) of the boxes around them that may be within reach."""
    height, width = shape
    low = np.ceil(sides.ends.min(axis=1) - metric.half)
    high = np.floor(sides.ends.max(axis=1) + metric.half)
    left, top = np.maximum(low, 0).astype(np.int64).T
    right, bottom = np.minimum(high, (width - 1, height - 1)).astype(np.int64).T
    k, y = expand_runs(top, np.maximum(bottom - top + 1, 0))
    row, x = expand_runs(left[k], np.maximum(right - left + 1, 0)[k])
    return k[row], x, y[row]


def _within_a_texel(off: Doubles, along: Doubles) -> Flags:
    """Whether some place t along, 0 <= t <= 1, is less than a texel from `off` (2, n) along both axes."""
    low, high = np.minimum(along, 0.0), np.maximum(along, 0.0)
    found = np.asarray(((off > low - _TEXEL) & (off < high + _TEXEL)).all(axis=0))
    off, along = off[:, found], along[:, found]
    along = np.where(np.abs(along) < 1e-12, 1e-12, along)
    ends = np.sort(np.stack(((off - _TEXEL) / along, (off + _TEXEL) / along)), axis=0)
    found[found] = np.maximum(ends[0].max(axis=0), 0.0) <= np.minimum(ends[1].min(axis=0), 1.0)
    return found
