"""Pixels for the empty space of a map, so that no filter finds black beside what is there."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


def fill_empty(image: NDArray[np.floating[Any]], known: NDArray[np.bool_]) -> Floats:
    """The picture with the mean of what is near where it is not known.

    image : (H, W, C) with sides that are powers of two
    known : (H, W) pixels that stay as they are

    Pulled down to ever coarser means and pushed up again.

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
