"""Where things are on the average head, and how large people are."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from dermis.tables import numbers, read_rows

LANDMARKS: Mapping[str, NDArray[np.float64]] = MappingProxyType(
    {row["landmark"]: numbers([row], "x y z")[0] for row in read_rows(__package__, "landmarks")}
)
"""Places (3,) on the left half of the symmetric, average head [mm]."""
INSIDE = frozenset({"eye"})
"""Landmarks that are centres and do not lie on the skin."""


def published() -> dict[str, tuple[float, float]]:
    """Mean of men and of women by measure [mm]; sources [Gordon1989], [Farkas2005]."""
    rows = read_rows(__package__, "anthropometry")
    return {row["measure"]: (float(row["male"]), float(row["female"])) for row in rows}


def nominal(name: str) -> NDArray[np.float64]:
    """A copy of the landmark (3,) on the average head [mm]."""
    return LANDMARKS[name].copy()
