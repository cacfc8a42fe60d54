"""Directions spread evenly over the sphere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def fibonacci_sphere(count: int) -> NDArray[np.float64]:
    """(count, 3) unit vectors along a golden spiral about +Y, each for an equal share of the sphere.

    Source: [Keinert2015].
    """
    index = np.arange(count) + 0.5
    y = 1.0 - 2.0 * index / count
    phi = np.pi * (1.0 + np.sqrt(5.0)) * index
    r = np.sqrt(1.0 - y**2)
    return np.stack([r * np.cos(phi), y, r * np.sin(phi)], axis=-1)
