"""What expressions do to the skin itself: folds that deepen, and blood that comes and goes."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dermis.base.tables import read_rows

Floats = NDArray[np.float32]

MOVEMENTS = (
    "raised-brows",
    "frown",
    "sneer",
    "squint",
    "smile",
    "sad-mouth",
    "raised-chin",
    "flush",
    "pressed",
)
"""Those that deepen folds, see folds.csv, then those that move blood."""
FOLDING = MOVEMENTS.index("flush")
"""How many deepen folds."""


def movements(names: tuple[str, ...], weights: Floats) -> Floats:
    """(m,) how far each movement is made, 0 to 1.

    names, weights : of a rig's targets
    """
    return np.asarray(np.clip(_shares(names) @ weights, 0.0, 1.0), np.float32)


@cache
def _shares(names: tuple[str, ...]) -> Floats:
    """(m, t) of each target in each movement."""
    table = np.zeros((len(MOVEMENTS), len(names)), np.float32)
    for row in read_rows(__package__, "movements"):
        if row["target"] in names:
            table[MOVEMENTS.index(row["movement"]), names.index(row["target"])] = float(row["share"])
    return table
