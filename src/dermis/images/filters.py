"""Filters of whole pictures: mip levels, and smoothing of quantised height maps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Floats

_ROWS_PER_STRIP = 16  # rows filtered at a time, which fit into the processor cache


def mip_chain(image: NDArray[np.floating]) -> list[Floats]:
    """Return a picture and its mip levels down to one texel, each a reduction of the previous level.

    image : (H, W, C) or (H, W), linear values; level k has max(1, H >> k) x max(1, W >> k) texels

    Along even sides, pairs of texels are averaged. An odd side of 2m + 1 texels becomes m texels. Each of
    these is the mean over a window of 2 + 1/m texels, in which three texels are weighted by their overlap
    with the window.
    """
    levels = [np.asarray(image, np.float32)]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(_halve_axis(_halve_axis(levels[-1], axis=0), axis=1))
    return levels


def _halve_axis(image: Floats, axis: int) -> Floats:
    size = image.shape[axis]
    if size == 1:
        return image
    texels = np.moveaxis(image, axis, 0)
    half = size // 2
    if size % 2 == 0:
        halved = 0.5 * (texels[0::2] + texels[1::2])
    else:
        index = np.arange(half, dtype=np.float32).reshape((half,) + (1,) * (image.ndim - 1))
        before, centre, after = texels[0:-1:2], texels[1::2], texels[2::2]
        halved = ((half - index) * before + half * centre + (index + 1) * after) / size
    return np.ascontiguousarray(np.moveaxis(halved, 0, axis), np.float32)


def smooth_quantisation(height_map: NDArray[np.floating]) -> Floats:
    """Smooth a height map to remove the steps of 8-bit quantisation, which would look like contour lines.

    The filter is binomial over seven texels along each axis, with a standard deviation of 1.2 texels.

    height_map : (H, W) heights in any unit
    """
    plain = np.asarray(height_map, np.float32)
    padded, smooth = np.pad(plain, 3, "edge"), np.empty_like(plain)
    for top in range(0, len(plain), _ROWS_PER_STRIP):
        rows = padded[top : top + _ROWS_PER_STRIP + 6]
        for _ in range(6):
            rows = rows[1:] + rows[:-1]
        for _ in range(6):
            rows = rows[:, 1:] + rows[:, :-1]
        np.multiply(rows, np.float32(1 / 4096), out=smooth[top : top + _ROWS_PER_STRIP])
    return smooth
