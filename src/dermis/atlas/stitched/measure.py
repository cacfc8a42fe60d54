"""Stretch of the map and unbroken runs over the texels of a cover."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.stitched.border import Placing
from dermis.atlas.stitched.cover import Cover
from dermis.atlas.stitched.surface import Surface

Doubles = NDArray[np.float64]
Singles = NDArray[np.float32]

_STEPS, _SLACK_MM = (
    2.0,
    0.5,
)  # neighbours farther apart than this many of their steps, and this much, are none


def metric_of(surface: Surface, placing: Placing, made: Cover) -> Singles:
    """(h, w, 3) texels per mm along u and v and the cosine between them; beyond a border as there."""
    metric = _read(made.rooted, made.roots, surface.lengths)
    covered = made.rooted >= 0
    per_uv = placing.per_uv[made.rooted[covered]].astype(np.float32)
    metric[covered, :2] = per_uv[:, None] / np.maximum(metric[covered, :2], 1e-3)
    return metric


def roots_of(placing: Placing, made: Cover) -> Singles:
    """(h, w, 2) nearest place on its own piece [texel] of each texel."""
    return _read(made.rooted, made.roots, placing.places)


def runs_of(
    surface: Surface, made: Cover, chart: NDArray[np.int32], metric: Singles, roots: Singles
) -> NDArray[np.uint16]:
    """(h, w, 4) texels to the left, right, up and down of the same chart, as far as the surface goes on.

    chart : (h, w) -1 where nothing is
    metric, roots : of `metric_of` and `roots_of`
    """
    from dermis.atlas.stitched.kernels.texels import runs

    points = _read(made.triangle, made.weights, surface.corners)
    reach = np.zeros((*chart.shape, 4), np.uint16)
    runs(chart, points, roots, metric, _STEPS, _SLACK_MM, reach)
    return reach


def _read(triangle: NDArray[np.int32], weights: Singles, corners: Doubles) -> Singles:
    """(h, w, c) of (f, 3, c) at corners, 0 where there is no triangle."""
    from dermis.atlas.stitched.kernels.texels import read

    values = np.zeros((*triangle.shape, corners.shape[2]), np.float32)
    read(triangle, weights, corners, values)
    return values
