"""Filters over whole pictures: mip levels, smoothing, and filling of empty space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Floats, Mask

_STRIP = 16  # rows filtered at a time, which stay in the cache


def mip_chain(image: NDArray[np.floating]) -> list[Floats]:
    """The picture and its mip levels down to one texel, each the mean of the one before.

    image : (H, W, C) or (H, W), linear values; level k has max(1, H >> k) x max(1, W >> k) texels

    An even side is averaged in pairs. An odd side of 2m + 1 texels goes to m texels, each as wide as
    2 + 1/m of the old ones: three taps whose weights are the overlaps.
    """
    levels = [np.asarray(image, np.float32)]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(_halve(_halve(levels[-1], axis=0), axis=1))
    return levels


def _halve(image: Floats, axis: int) -> Floats:
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


def without_steps(height: NDArray[np.floating]) -> Floats:
    """A height map smoothed by 1.2 texels, since 8-bit steps would show as contour lines.

    height : (H, W) in any unit

    Six sums of two neighbours along each axis: binomial weights of seven texels.
    """
    plain = np.asarray(height, np.float32)
    padded, smooth = np.pad(plain, 3, "edge"), np.empty_like(plain)
    for top in range(0, len(plain), _STRIP):
        rows = padded[top : top + _STRIP + 6]
        for _ in range(6):
            rows = rows[1:] + rows[:-1]
        for _ in range(6):
            rows = rows[:, 1:] + rows[:, :-1]
        np.multiply(rows, np.float32(1 / 4096), out=smooth[top : top + _STRIP])
    return smooth


def fill_empty(image: NDArray[np.floating], known: Mask) -> Floats:
    """The picture with unknown pixels filled with the mean of known ones near by.

    image : (H, W, C) with sides that are powers of two
    known : (H, W) pixels that stay as they are

    Pull-push: means of ever coarser levels, then back up.

    Source: [Gortler1996] section 3.6.
    """
    weight = known[..., None].astype(np.float32)
    levels: list[tuple[Floats, Floats]] = [(np.where(known[..., None], image, 0).astype(np.float32), weight)]
    while len(levels[-1][0]) > 1:
        total, count = (_halved(part) for part in levels[-1])
        share: Floats = np.minimum(count, np.float32(1.0))
        mean = np.asarray(total / np.maximum(count, np.float32(1e-6)), np.float32)
        levels.append((mean * share, share))
    filled = levels[-1][0]
    for total, share in reversed(levels[:-1]):
        filled = total + (1.0 - share) * _doubled(filled)
    return filled


def _halved(part: Floats) -> Floats:
    """Sums of 2 x 2 pixels."""
    return part[0::2, 0::2] + part[1::2, 0::2] + part[0::2, 1::2] + part[1::2, 1::2]


def _doubled(part: Floats) -> Floats:
    """Twice the size, each pixel four times."""
    return part.repeat(2, axis=0).repeat(2, axis=1)
