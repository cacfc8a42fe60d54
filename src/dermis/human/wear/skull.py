"""Skull of a person as a radius by direction, to which headwear is fitted."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Mask
from dermis.human.wear.skin_sheet import head_sheet, unit_vectors

EAR_TOPS = 4597, 2176
"""Control points at the top of the left and the right ear."""
_CENTRE_ABOVE_EARS_MM = np.array([0.0, 22.0, 2.0])
_NEIGHBOURS = 5  # nearest points of skin, of which the outermost is used
_LOWEST_MM = -75.0  # height relative to the centre below which skin is left out


class Skull(NamedTuple):
    """Distance of the skin from the centre of a person's skull, by direction.

    centre_mm : (3,) centre of the skull [mm]
    tree : k-d tree over the directions from the centre to points of skin
    radius_mm : (n,) distances of these points [mm]
    """

    centre_mm: Doubles
    tree: Any
    radius_mm: Doubles

    def radius_in(self, directions: Doubles) -> Doubles:
        """Return the largest radius (...,) of the skin without ears near unit vectors (..., 3) [mm]."""
        near = self.tree.query(directions, k=_NEIGHBOURS)[1]
        return np.asarray(self.radius_mm[near].max(axis=-1))


def fit_skull(control_mm: Doubles) -> Skull:
    """Return the skull of a person.

    control_mm : (p, 3) control points of the person at rest
    """
    from scipy.spatial import cKDTree

    sheet = head_sheet()
    points = np.asarray(sheet.weights @ control_mm[: sheet.weights.shape[1]])[~ear_mask()]
    centre = control_mm[list(EAR_TOPS)].mean(axis=0) + _CENTRE_ABOVE_EARS_MM
    offset = (points - centre)[points[:, 1] > centre[1] + _LOWEST_MM]
    return Skull(centre, cKDTree(unit_vectors(offset)), np.linalg.norm(offset, axis=1))


def unit_direction(azimuth: Doubles, elevation: Doubles) -> Doubles:
    """Return unit vectors (..., 3) by azimuth from the front towards the left and by elevation [rad]."""
    azimuth, elevation = np.broadcast_arrays(azimuth, elevation)
    flat = np.cos(elevation)
    return np.stack([flat * np.sin(azimuth), np.sin(elevation), flat * np.cos(azimuth)], axis=-1)


@cache
def ear_mask() -> Mask:
    """Return the mask (n,) of the points of the sheet of the head that belong to ears."""
    x, y, z = head_sheet().mean_mm.T
    return np.asarray((np.abs(x) > 69.0 + 0.2 * np.maximum(y, 0.0)) & (np.abs(y + 20.0) < 32.0) & (z < -58.0))
