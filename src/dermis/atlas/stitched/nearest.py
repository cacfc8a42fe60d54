"""Search for the nearest border point of each texel around a chart piece."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index, Mask
from dermis.mesh.geometry import expand_runs

_RIM_WIDTH_TEXELS = 1.001  # a texel, with a margin for rounding


class BorderSides(NamedTuple):
    """Triangle sides (k,) on the borders of chart pieces, placed on the texel grid, with the gutter width.

    ends : (k, 2, 2) positions of both end points [texel]
    steps : (k, 2, 2, 2) surface vectors of steps by one texel [mm]. The second axis is for the two end
        points, the third for the step (to the right, down), and the last for the components of the vector in
        the plane of the triangle
    gutter_mm : (k,) width of the gutter on the surface [mm]
    max_texels : (k,) largest width of the gutter on the grid [texel]
    """

    ends: Doubles
    steps: Doubles
    gutter_mm: Doubles
    max_texels: Doubles


class NearestPoints(NamedTuple):
    """For each of n texels outside the chart pieces, the nearest point on the border of a piece.

    texel : flat index of the texel
    side : index, in `BorderSides`, of the border side on which the nearest point lies
    fraction : position of the point along this side, 0 to 1 [-]
    distance_mm : distance from the texel to the point, converted to mm by the surface metric at this side
        [mm]
    rim : mask of texels that are read by bilinear interpolation at border points
    """

    texel: Index
    side: Index
    fraction: Doubles
    distance_mm: Doubles
    rim: Mask


class _SideMetric(NamedTuple):
    """Surface metric at k border sides (see `BorderSides`), which converts offsets on the texel grid to mm.

    x, y, down : (k,) entries of the upper triangular matrix ((x, y), (0, down)), which converts an offset
        (dx, dy) [texel] to a vector (x dx + y dy, down dy) whose length is the distance on the surface [mm]
    along : (k, 2) lengths of a step by one texel along x and of a step by one texel along y, projected onto
        the side, as fractions of the side's length
    half_extent : (k, 2) margin in x and y around the side's bounding box, wide enough for the gutter [texel]
    """

    x: Doubles
    y: Doubles
    down: Doubles
    along: Doubles
    half_extent: Doubles


def nearest_border_points(sides: BorderSides, inside_mask: Mask) -> NearestPoints:
    """Return the nearest border point of each texel that is in a gutter or in the rim of a piece.

    Distances are measured by the surface metric at each border side. The rim consists of the texels that
    are read by bilinear interpolation at border points.

    sides : border sides on the texel grid
    inside_mask : (h, w) mask of texels that chart pieces cover
    """
    metric = _side_metric(sides)
    k, x, y = _candidate_texels(sides, metric, inside_mask.shape)
    texel = y * inside_mask.shape[1] + x
    outside = ~inside_mask.ravel()[texel]
    k, x, y, texel = k[outside], x[outside], y[outside], texel[outside]
    offset, along = np.stack((x, y)) - sides.ends[k, 0].T, np.diff(sides.ends, axis=1)[k, 0].T
    fraction = np.clip((metric.along[k].T * offset).sum(axis=0), 0.0, 1.0)
    v = offset - fraction * along
    distance2 = (metric.x[k] * v[0] + metric.y[k] * v[1]) ** 2 + (metric.down[k] * v[1]) ** 2
    rim = _within_texel_of_segment(offset, along)
    near = np.flatnonzero(rim | (distance2 < sides.gutter_mm[k] ** 2))
    nearest2 = np.full(inside_mask.size, np.inf)
    np.minimum.at(nearest2, texel[near], distance2[near])
    first = np.full(inside_mask.size, -1)
    best = near[distance2[near] == nearest2[texel[near]]][::-1]
    first[texel[best]] = best
    on_rim = np.zeros(inside_mask.size, np.bool_)
    on_rim[texel[rim]] = True
    found = first[first >= 0]
    return NearestPoints(
        texel[found], k[found], fraction[found], np.sqrt(distance2[found]), on_rim[texel[found]]
    )


def _side_metric(sides: BorderSides) -> _SideMetric:
    u, v = np.moveaxis(sides.steps.mean(axis=1), 1, 0)
    e, f, g = (u * u).sum(axis=1), (u * v).sum(axis=1), (v * v).sum(axis=1)
    det = np.maximum(np.maximum(e * g - f * f, 1e-9 * e * g), 1e-30)
    reach = sides.gutter_mm * np.sqrt(np.stack((g, e)) / det)
    half_extent = np.maximum(np.minimum(reach, sides.max_texels), _RIM_WIDTH_TEXELS).T
    x, y = (sides.ends[:, 1] - sides.ends[:, 0]).T
    length = np.maximum(e * x * x + 2 * f * x * y + g * y * y, 1e-30)
    along = np.column_stack((e * x + f * y, f * x + g * y)) / length[:, None]
    scale = np.sqrt(np.maximum(e, 1e-30))
    return _SideMetric(scale, f / scale, np.sqrt(det) / scale, along, half_extent)


def _candidate_texels(
    sides: BorderSides, metric: _SideMetric, grid_shape: tuple[int, ...]
) -> tuple[Index, Index, Index]:
    """Return texels that may be in a gutter, as three arrays (n,): index of the border side, x and y.

    sides, metric : border sides on the texel grid, and their surface metric
    grid_shape : height and width of the grid of texels
    """
    height, width = grid_shape
    low = np.ceil(sides.ends.min(axis=1) - metric.half_extent)
    high = np.floor(sides.ends.max(axis=1) + metric.half_extent)
    left, top = np.maximum(low, 0).astype(np.int64).T
    right, bottom = np.minimum(high, (width - 1, height - 1)).astype(np.int64).T
    k, y = expand_runs(top, np.maximum(bottom - top + 1, 0))
    row, x = expand_runs(left[k], np.maximum(right - left + 1, 0)[k])
    return k[row], x, y[row]


def _within_texel_of_segment(offset: Doubles, along: Doubles) -> Mask:
    """Return the mask of offsets (2, n) that are within a texel of the segment from 0 to `along` (2, n)."""
    low, high = np.minimum(along, 0.0), np.maximum(along, 0.0)
    found = np.asarray(((offset > low - _RIM_WIDTH_TEXELS) & (offset < high + _RIM_WIDTH_TEXELS)).all(axis=0))
    offset, along = offset[:, found], along[:, found]
    along = np.where(np.abs(along) < 1e-12, 1e-12, along)
    ends = np.sort(
        np.stack(((offset - _RIM_WIDTH_TEXELS) / along, (offset + _RIM_WIDTH_TEXELS) / along)), axis=0
    )
    found[found] = np.maximum(ends[0].max(axis=0), 0.0) <= np.minimum(ends[1].min(axis=0), 1.0)
    return found
