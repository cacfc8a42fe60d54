"""Folds of cloth: procedural patterns of height around arms and neck of the mean person, chosen by eye."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Index
from dermis.human.curves import smoothstep

_ARMPIT_MM = np.array([128.0, -262.0, -95.0])
_SHOULDER_MM, _ARM_DIRECTION = np.array([150.0, -190.0, -100.0]), np.array([0.76, -0.65, 0.0])
_RIDGES_PER_RADIAN, _RIDGE_WIDTH = 2.1, 0.26
_LATTICE_SIZE = 64  # period of the noise [cells]


class Folds(NamedTuple):
    """Heights of the folds of a cloth.

    drag_mm : height of folds that radiate from the armpits [mm]
    sleeve_mm : height of folds around the upper arms [mm]
    drape_mm : height of wide soft folds [mm]
    crumple_mm : height of small folds [mm]
    """

    drag_mm: float
    sleeve_mm: float
    drape_mm: float
    crumple_mm: float

    def heights_mm(self, mean_mm: Doubles) -> Doubles:
        """Return the heights (n,) of folds at points (n, 3) on the mean person, at least 0 [mm]."""
        bend = smooth_noise(mean_mm / 38.0, 1)
        height = self.drag_mm * _drag_folds(mean_mm, bend)
        height += self.sleeve_mm * _sleeve_folds(mean_mm, bend)
        height += self.drape_mm * (0.5 + 0.5 * smooth_noise(mean_mm * [1.0, 0.45, 1.0] / 48.0, 2))
        height += self.drape_mm * 0.6 * _hanging_folds(mean_mm, bend)
        return height + self.crumple_mm * np.maximum(smooth_noise(mean_mm / 19.0, 3), 0.0)


def smooth_noise(points: Doubles, seed: int) -> Doubles:
    """Return value noise (n,) from -1 to 1 at points (n, 3), whose unit is the spacing of the lattice."""
    values = np.random.default_rng((seed, 71)).uniform(-1.0, 1.0, (_LATTICE_SIZE,) * 3)
    cell = np.floor(points).astype(np.int64)
    t = points - cell
    t = t * t * t * (t * (6.0 * t - 15.0) + 10.0)
    total = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        x, y, z = ((cell + corner) % _LATTICE_SIZE).T
        total += values[x, y, z] * np.prod(np.where(corner, t, 1.0 - t), axis=1)
    return total


def _ridges(phase: Doubles, seed: int) -> Doubles:
    """Return the heights (n,) of random rounded ridges, 0 to 1; each unit of the phase (n,) has one ridge."""
    index: Index = np.floor(phase).astype(np.int64)
    strength = np.random.default_rng((seed, 72)).uniform(0.25, 1.0, 256)[index % 256]
    width = _RIDGE_WIDTH * (0.7 + 0.6 * np.random.default_rng((seed, 73)).random(256)[index % 256])
    return np.asarray(strength * np.exp(-(((phase - index - 0.5) / width) ** 2)))


def _drag_folds(mean_mm: Doubles, bend: Doubles) -> Doubles:
    """Return the relative height (n,) of folds that radiate from the armpits over chest and back."""
    x, y, z = np.abs(mean_mm[:, 0]), mean_mm[:, 1], mean_mm[:, 2]
    side, up = x - _ARMPIT_MM[0], y - _ARMPIT_MM[1]
    r = np.sqrt(side**2 + up**2 + 1e-9)
    angle = np.arctan2(up, -side) + 0.22 * bend
    quarter = 2.0 * (mean_mm[:, 0] > 0) + (z > _ARMPIT_MM[2])
    ridges = _ridges(_RIDGES_PER_RADIAN * angle + 37.0 * quarter, 4)
    return np.asarray(ridges * smoothstep(22.0, 62.0, r) * smoothstep(165.0, 80.0, r))


def _sleeve_folds(mean_mm: Doubles, bend: Doubles) -> Doubles:
    """Return the relative height (n,) of folds around the upper arms."""
    folded = mean_mm.copy()
    folded[:, 0] = np.abs(folded[:, 0])
    along = (folded - _SHOULDER_MM) @ _ARM_DIRECTION
    ridges = _ridges(along / 25.0 + 0.9 * bend + 19.0 * (mean_mm[:, 0] > 0), 5)
    return np.asarray(ridges * smoothstep(25.0, 60.0, along))


def _hanging_folds(mean_mm: Doubles, bend: Doubles) -> Doubles:
    """Return the relative height (n,) of arcs that hang between the shoulders below the neck."""
    x, y, z = np.abs(mean_mm[:, 0]), mean_mm[:, 1], mean_mm[:, 2]
    arc = np.hypot(0.8 * x, y + 110.0)
    ridges = _ridges(arc / 27.0 + 0.9 * bend + 11.0 * (z > -92.0), 6)
    return np.asarray(ridges * smoothstep(110.0, 40.0, x) * smoothstep(70.0, 110.0, arc))
