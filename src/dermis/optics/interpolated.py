"""Tables that are smooth over a number, between those made at evenly spaced ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
STEPS = 64
"""Between tables at 0 and at 1."""


def interpolated(made: Callable[[float], Floats], at: float) -> Floats:
    """The table at a number in 0..1.

    made : the same at a multiple of 1 / STEPS; to be remembered by the caller
    """
    place = min(max(at, 0.0), 1.0) * STEPS
    low = min(int(place), STEPS - 1)
    share = place - low
    return np.asarray((1.0 - share) * made(low / STEPS) + share * made((low + 1) / STEPS))
