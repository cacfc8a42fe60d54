"""A layout of eyeballs with most room for the iris, and what is painted by it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

RIM = 0.49
"""Distance from the middle of the layout for half a turn from the axis."""
FALLING = 0.9
"""Angle from the axis over which that distance grows less and less [rad]."""


@dataclass(frozen=True, eq=False)
class EyePictures:
    """An eyeball as it is seen along its axis, by the layout, row 0 at v = 0.

    colour : (n, n, 3) linear [-]
    normal : (n, n, 3) unit, of what lies below the film of tears, by the axes of the layout, green up
    """

    colour: NDArray[np.float32]
    normal: NDArray[np.float32]


def eye_uv(places: Doubles) -> NDArray[np.float32]:
    """(n, 2) uv of places around an eyeball's middle (n, 3), z along its axis."""
    across = np.hypot(places[:, 0], places[:, 1])
    angle = np.arctan2(across, places[:, 2])
    radius = RIM * np.expm1(-angle / FALLING) / np.expm1(-np.pi / FALLING)
    way = places[:, :2] * [1.0, -1.0] / np.maximum(across, 1e-12)[:, None]
    return np.asarray(0.5 + radius[:, None] * way, np.float32)
