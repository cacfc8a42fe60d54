"""Smoothing over the skin by distance in space, which knows nothing of charts and their seams."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

_CELL_MM = 2.0
_MOST_CELLS = 256  # along the longest side
_REACH = 3  # standard deviations


def soften(points: Doubles, values: Doubles, sigma_mm: float) -> Doubles:
    """Gaussian mean (n, c) of the values around each place; each piece of skin counts by its size.

    points : (n, 3) [mm]
    values : (n, c)
    sigma_mm : standard deviation [mm]
    """
    from scipy.ndimage import gaussian_filter, map_coordinates

    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    side = max(_CELL_MM, float(extent.max()) / _MOST_CELLS)
    place = (points - low) / side + 1
    shape = tuple(int(length) + 4 for length in extent / side)
    cell = np.ravel_multi_index(tuple(np.rint(place).astype(int).T), shape)
    count = np.bincount(cell, minlength=int(np.prod(shape)))

    def spread(quantity: Doubles) -> Doubles:
        grid = np.divide(quantity, count, out=np.zeros(len(count)), where=count > 0).reshape(shape)
        smooth = gaussian_filter(grid, sigma_mm / side, mode="constant", truncate=_REACH)
        return np.asarray(map_coordinates(smooth, place.T, order=1))

    weight = spread(count.astype(np.float64))
    sums = [np.bincount(cell, column, minlength=len(count)).astype(np.float64) for column in values.T]
    return np.stack([spread(column) / weight for column in sums], axis=-1)
