"""Filters over whole pictures: smaller copies, and slopes of a height map."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

# Rows filtered at a time: what is touched stays in the cache, which halves the time of a 4096² map.
_STRIP = 32


def mip_chain(image: NDArray[np.floating[Any]]) -> list[Floats]:
    """The picture and its halvings down to one texel, each with the mean of the one before.

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


def derivatives(
    height: NDArray[np.floating[Any]], border: Literal["clamp", "wrap"] = "clamp"
) -> tuple[Floats, Floats]:
    """(dh/dx, dh/dy): change of height per texel to the right and per texel DOWN, each (H, W).

    height : (H, W) in any unit, which the result carries per texel
    border : "clamp" goes on in a straight line beyond the edge, so that a tilted plane has one slope
        up to it; "wrap" takes the other side's texels, for a map that tiles

    Central differences smoothed across with Scharr's 3, 10, 3 weights: they keep a slope's direction
    to about a degree and take a third off the noise that 8-bit steps put on a slope.
    """
    padded = _pad(np.asarray(height, np.float32), border)
    rows, columns = height.shape
    dx, dy = np.empty((rows, columns), np.float32), np.empty((rows, columns), np.float32)
    for top in range(0, rows, _STRIP):
        bottom = min(top + _STRIP, rows)
        _scharr(padded[top : bottom + 2], dx[top:bottom], dy[top:bottom])
    return dx, dy


def _scharr(padded: Floats, dx: Floats, dy: Floats) -> None:
    """Write the slopes of the inner texels of a padded strip into dx and dy."""
    across = (3 / 32) * (padded[:-2] + padded[2:])
    across += (10 / 32) * padded[1:-1]
    np.subtract(across[:, 2:], across[:, :-2], out=dx)
    down = padded[2:] - padded[:-2]
    np.add(down[:, :-2], down[:, 2:], out=dy)
    dy *= 3 / 32
    down[:, 1:-1] *= 10 / 32
    dy += down[:, 1:-1]


def _pad(height: Floats, border: Literal["clamp", "wrap"]) -> Floats:
    if border == "wrap":
        return np.pad(height, 1, mode="wrap")
    return np.pad(height, 1, mode="reflect", reflect_type="odd")


def without_steps(height: NDArray[np.floating[Any]]) -> Floats:
    """A height map smoothed by 1.2 texels: the slopes of 8-bit steps draw contour lines, not pores.

    height : (H, W) in any unit
    """
    from scipy.ndimage import correlate1d

    binomial = np.array([1, 6, 15, 20, 15, 6, 1], np.float32) / 64
    smooth: Floats = np.asarray(height, np.float32)
    for axis in (0, 1):
        smooth = correlate1d(smooth, binomial, axis=axis, mode="nearest")
    return smooth
