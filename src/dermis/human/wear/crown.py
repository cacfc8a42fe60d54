"""Crown of headwear: a shell over a person's skull, in polar coordinates about its centre."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.wear.panels import Grid
from dermis.human.wear.skull import Skull, fit_skull, unit_direction
from dermis.human.wear.tubes import Solid

COLUMNS = 192
"""Number of columns of a crown; column 0 is at the front, columns proceed to the left."""
AZIMUTH = np.arange(COLUMNS) * 2.0 * np.pi / COLUMNS
"""Azimuth of the columns from the front [rad]."""
_ROWS = 40  # of the grid of base radii, from below the rim to the apex
_BELOW_RIM = 0.12  # of that grid, as a fraction of the way from the rim to the apex
_SMOOTHING_STEPS = 60  # by which cloth is stretched over hollows

Rim = tuple[tuple[float, ...], tuple[float, ...]]
"""Azimuths from the front and elevations of a rim [degrees]; the rim is the same on both sides."""
Height = Callable[[Doubles, Doubles], Doubles]
"""Function of azimuth [rad] and of the way from the rim (0) to the apex (1), which returns a height [mm]."""


class Row(NamedTuple):
    """Row of a shell: the way from the rim (0) to the apex (1), and the height above the skin [mm]."""

    way: Doubles
    height_mm: Doubles


class Crown(NamedTuple):
    """Stretched surface over a person's skull, above which headwear is placed.

    skull : skull of the person
    rim : rim of the headwear
    radius_mm : (_ROWS, COLUMNS) distance of the surface from the centre [mm]
    """

    skull: Skull
    rim: Rim
    radius_mm: Doubles

    def elevation(self, azimuth: Doubles, way: Doubles) -> Doubles:
        """Return the elevation of places on the crown [rad]."""
        low = np.radians(np.interp(np.degrees(_from_front(azimuth)), *self.rim))
        return np.asarray(low + way * (0.5 * np.pi - low))

    def way(self, azimuth: Doubles, elevation: Doubles) -> Doubles:
        """Return the way from the rim (0) to the apex (1) of directions [rad]; negative below the rim."""
        low = np.radians(np.interp(np.degrees(_from_front(azimuth)), *self.rim))
        return np.asarray((elevation - low) / (0.5 * np.pi - low))

    def base_radius_mm(self, azimuth: Doubles, way: Doubles) -> Doubles:
        """Return the distance of the stretched surface from the centre at places on the crown [mm]."""
        row = np.clip((way + _BELOW_RIM) / (1.0 + _BELOW_RIM), 0.0, 1.0) * (_ROWS - 1)
        column = (azimuth % (2.0 * np.pi)) / (2.0 * np.pi) * COLUMNS
        i, j = np.minimum(row.astype(int), _ROWS - 2), column.astype(int) % COLUMNS
        s, t = row - i, column - np.floor(column)
        near = self.radius_mm
        low, high = (
            (1.0 - t) * near[k, j] + t * near[k, (j + 1) % COLUMNS] for k in (i, np.minimum(i + 1, _ROWS - 1))
        )
        return np.asarray((1.0 - s) * low + s * high)

    def points(self, azimuth: Doubles, way: Doubles, height_mm: Doubles) -> Doubles:
        """Return points (..., 3) at heights above the surface [mm]."""
        radius = self.base_radius_mm(azimuth, way) + height_mm
        direction = unit_direction(azimuth, self.elevation(azimuth, way))
        return np.asarray(self.skull.centre_mm + radius[..., None] * direction)

    def shell(self, rows: Sequence[Row], slot: str) -> Solid:
        """Return a closed band of rows, from the inside upwards over an edge, or along the outside."""
        way = np.stack([np.broadcast_to(row.way, COLUMNS) for row in rows])
        height = np.stack([np.broadcast_to(row.height_mm, COLUMNS) for row in rows])
        points = self.points(np.broadcast_to(AZIMUTH, way.shape), way, height)
        grid = Grid(len(rows), COLUMNS, True)
        step = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=-1).mean(axis=1)
        widest = np.linalg.norm(points - self.skull.centre_mm, axis=-1).mean()
        u, v = np.broadcast_arrays(AZIMUTH * widest, np.cumsum(step)[:, None])
        flat = points.reshape(-1, 3)
        vertices = grid.vertices(np.stack([u, v], axis=-1).reshape(-1, 2))
        return Solid(flat, vertices.triangles_of_points, slot, vertices)


def fit_crown(control_mm: Doubles, rim: Rim) -> Crown:
    """Return the crown over the skull of a person.

    control_mm : (p, 3) control points of the person at rest
    """
    skull = fit_skull(control_mm)
    way = np.linspace(-_BELOW_RIM, 1.0, _ROWS)[:, None]
    crown = Crown(skull, rim, np.zeros((_ROWS, COLUMNS)))
    least = skull.radius_in(unit_direction(AZIMUTH, crown.elevation(AZIMUTH, way)))
    least[-1] = least[-1].max()
    radius = least.copy()
    for _ in range(_SMOOTHING_STEPS):
        mean = 0.5 * (np.roll(radius, 1, axis=1) + np.roll(radius, -1, axis=1))
        mean[1:-1] = 0.5 * mean[1:-1] + 0.25 * (radius[:-2] + radius[2:])
        mean[-1] = mean[-2].mean()
        radius = np.maximum(least, mean)
    return crown._replace(radius_mm=radius)


def _from_front(azimuth: Doubles) -> Doubles:
    """Return the unsigned angle from the front, 0 to pi [rad]."""
    turned = np.asarray(azimuth) % (2.0 * np.pi)
    return np.asarray(np.minimum(turned, 2.0 * np.pi - turned))
