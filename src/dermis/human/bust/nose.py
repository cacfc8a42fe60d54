"""The nose: bridge, tip, wings, septum and nostrils."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.human.bust.fields import (
    Doubles,
    cone,
    ellipsoid,
    rise,
    rotation,
    smooth_difference,
    smooth_union,
    tube,
)
from dermis.human.bust.parameters import BustParameters

# Artist's values along the bridge: x, y, z, radius [mm].
BRIDGE = [(0, 16, 79, 8), (0, 4, 82.5, 6.5), (0, -10, 92, 6), (0, -24, 100, 6.2), (0, -34, 104.5, 7)]
BASE = np.array([0.0, -47.0, 88.0])
"""What stays where it is when the nose grows [mm]."""


def add_nose(distance: Doubles, p: Doubles, parameters: BustParameters) -> Doubles:
    """The face with the nose grown on it and the nostrils carved; p with x >= 0."""
    near = (p[:, 0] < 40) & (np.abs(p[:, 1] + 20) < 55) & (p[:, 2] > 60)
    local = BASE + (p[near] - BASE) / growth(parameters)
    # soft flanks above, a crease around the wings
    blend = 4.5 + 9 * rise(local[:, 1], -42, -25)
    grown = smooth_union(distance[near], _body(local), blend)
    joined = distance.copy()
    joined[near] = smooth_difference(grown, _nostril(local), 3.2)
    return joined


def belongs(p: Doubles, parameters: BustParameters) -> NDArray[np.bool_]:
    """Which places (n, 3) on the skin are nose; x >= 0."""
    local = BASE + (p - BASE) / growth(parameters)
    grown = (_body(local) < 0.9) | (_nostril(local) < 0.9)
    return np.asarray(grown & (local[:, 1] < 10) & (local[:, 1] > -49.5))


def growth(parameters: BustParameters) -> Doubles:
    """Factors along x, y and z from `BASE`: a large nose is broad and stands out, but is hardly longer."""
    size = parameters.nose
    return np.array([size, 1 + 0.2 * (size - 1), size])


def _body(p: Doubles) -> Doubles:
    walls = ellipsoid(p, (0, -22, 84), (13.5, 24, 17), rotation(0, 24))
    bridge = smooth_union(tube(p, BRIDGE), walls, 9)
    dome = ellipsoid(p, (3.4, -37.8, 107.4), (5.6, 6.2, 6.8))
    tip = smooth_union(ellipsoid(p, (0, -37.0, 106.0), (6.6, 7.0, 9.0)), dome, 5)
    septum = cone(p, (0, -42.6, 107.5), (0, -46.2, 96.0), 3.2, 4.2)
    flank = ellipsoid(p, (7.0, -34.0, 95.0), (6.0, 9.0, 10.0))
    wing = ellipsoid(p, (10.7, -41.8, 97.6), (4.4, 5.6, 9.4), rotation(1, 26) @ rotation(0, -16))
    body = smooth_union(bridge, smooth_union(tip, septum, 5), 9)
    return smooth_union(smooth_union(body, flank, 9), wing, 8)


def _nostril(p: Doubles) -> Doubles:
    return ellipsoid(p, (6.3, -46.2, 101.2), (2.9, 5.8, 5.6), rotation(1, -20) @ rotation(0, 12))
