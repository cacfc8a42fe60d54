"""Sheets placed side by side in the unit square."""

from __future__ import annotations

from collections.abc import Iterator
from math import factorial

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse

Index = NDArray[np.int64]
Doubles = NDArray[np.float64]

_CELLS = 512  # columns and rows of the square
_PLACINGS = 1000  # of sheets, over all orders that are tried
_HALVINGS = 9  # in the search for the scale
_GAIN = 1.004  # of the scale, for an order to be worth a search


def pack(outlines: list[Doubles], padding: float) -> tuple[float, Doubles]:
    """Scale, and offset (c, 2) of each sheet, that bring scale * places + offset into the unit square.

    outlines : ends (k, 2, 2) of the sides of each sheet's border, counter-clockwise around it
    padding : empty space between sheets, half as much to the edge of the square, of the square's side

    Each sheet is let down onto those below, where it comes to lie lowest [Levy2002], in several orders.

    Raises DermisError when there are more sheets than fit side by side.
    """
    corner = np.array([sides.min(axis=(0, 1)) for sides in outlines])
    moved = [sides - low for sides, low in zip(outlines, corner, strict=True)]
    size = np.array([sides.max(axis=(0, 1)) for sides in moved])
    bound = _CELLS / np.sqrt(max(sum(_area(sides) for sides in moved), (size**2).max()))
    best, cells = 0.0, None
    for order in _orders(size):
        low, high = best, bound
        if cells is not None and _place(moved, order, best * _GAIN, padding) is None:
            continue
        for _ in range(_HALVINGS):
            scale = (low + high) / 2
            found = _place(moved, order, scale, padding)
            if found is None:
                high = scale
            else:
                best, cells, low = scale, found, scale
    if cells is None:
        refuse("charts", "fewer charts", f"{len(outlines)} came", "Cut the mesh into larger charts")
    return best / _CELLS, (cells - best * corner) / _CELLS


def _area(sides: Doubles) -> float:
    (x0, y0), (x1, y1) = sides[:, 0].T, sides[:, 1].T
    return float((x0 * y1 - x1 * y0).sum() / 2)


def _orders(size: Doubles) -> Iterator[Index]:
    """Which sheet comes first: the highest, the widest, or any."""
    yield np.argsort(-size[:, 1], kind="stable")
    yield np.argsort(-size[:, 0], kind="stable")
    random = np.random.default_rng(0)
    for _ in range(min(_PLACINGS // len(size), factorial(len(size)) - 2)):
        yield random.permutation(len(size))


def _place(moved: list[Doubles], order: Index, scale: float, padding: float) -> Doubles | None:
    """Where the lower left corners (c, 2) of the sheets come to lie [cells], None if they do not all fit.

    moved : outlines with their lower left corner at 0
    scale : [cells per unit of these]
    """
    margin = int(np.ceil(padding * _CELLS / 2))
    horizon, cells = np.zeros(_CELLS, dtype=np.int64), np.zeros((len(moved), 2))
    for k in order:
        low, high = _profile(moved[k] * scale, margin)
        if len(low) > _CELLS:
            return None
        rest = (np.lib.stride_tricks.sliding_window_view(horizon, len(low)) - low).max(axis=1)
        x = int(rest.argmin())
        y = int(rest[x])
        if y + high.max() >= _CELLS:
            return None
        horizon[x : x + len(low)] = np.maximum(horizon[x : x + len(low)], y + high + 1)
        cells[k] = x + margin, y + margin
    return cells


def _profile(sides: Doubles, margin: int) -> tuple[Index, Index]:
    """Lowest and highest cell (w,) of a sheet in each column, with empty cells around it.

    sides : ends (k, 2, 2) [cells]
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    steps = np.ceil(2 * np.abs(sides[:, 1] - sides[:, 0]).max(axis=1)).astype(np.int64) + 1
    which = np.repeat(np.arange(len(sides)), steps)
    t = (np.arange(len(which)) - np.repeat(np.cumsum(steps) - steps, steps)) / steps[which]
    x, y = (sides[which, 0] * (1 - t)[:, None] + sides[which, 1] * t[:, None]).astype(np.int64).T
    width = int(x.max()) + 1 + 2 * margin
    low, high = np.full(width, _CELLS), np.full(width, -_CELLS)
    np.minimum.at(low, x + margin, y)
    np.maximum.at(high, x + margin, y)
    around = 2 * margin + 1
    return minimum_filter1d(low, around), maximum_filter1d(high, around) + 2 * margin
