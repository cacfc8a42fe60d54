"""Cheeks that bunch in smiles: forward displacement of the skin beside the nasolabial fold.

MakeHuman's blend shapes of smiles raise the cheeks without bulging them.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.tables import float_columns, read_rows
from dermis.human.makehuman import Points, makehuman_arrays
from dermis.human.skin.surface import average_surface

# Artist's values for the average person.
_APPLE_MM = 34.0, -27.0
"""Distance from the middle of the face, and height, of the largest displacement [mm]."""
_HALF_SIZE_MM = 15.0, 13.0
"""Distances from that point, sideways and upwards, at which the displacement falls to 1/e [mm]."""
_FOLD_WIDTH_MM = 9.0
"""Distance from the nasolabial fold within which the displacement rises from 0 [mm]."""
_LID_HEIGHTS_MM = -17.0, -9.0
"""Heights between which the displacement fades out below the lower lid [mm]."""
_DIRECTION = np.array([0.42, 0.12, 0.9]) / np.linalg.norm([0.42, 0.12, 0.9])
_MIN_DISPLACEMENT = 0.02  # relative to the largest one


class CheekBulge(NamedTuple):
    """Displacement of the skin of one cheek by a morph target.

    point : (n,) indices of MakeHuman's points
    delta_mm : (n, 3) displacements at a weight of 1 [mm]
    """

    point: NDArray[np.int64]
    delta_mm: Points


@cache
def cheek_bulges() -> dict[str, CheekBulge]:
    """Return the displacements that are added to MakeHuman's blend shapes, by name of the morph target."""
    bulges = dict[str, CheekBulge]()
    rows = read_rows("dermis.human", "cheek_bulges")
    for side_name, side in (("Left", 1.0), ("Right", -1.0)):
        point, weight = _cheek_weights(side)
        direction = _DIRECTION * [side, 1.0, 1.0]
        for row in rows:
            delta_mm = float(row["bulge_mm"]) * weight[:, None] * direction
            bulges[row["target"] + side_name] = CheekBulge(point, delta_mm)
    return bulges


def _cheek_weights(side: float) -> tuple[NDArray[np.int64], Points]:
    """Return the points (n,) of a cheek, and their displacements relative to the largest one (n,).

    side : 1 for the left cheek, at +X; -1 for the right cheek
    """
    arrays = makehuman_arrays()
    skin = np.unique(arrays["quads"][arrays["group"] == 0]).astype(np.int64)
    x, y, z = average_surface()[0][skin].astype(np.float64).T
    x = side * x
    knots = [row for row in read_rows("dermis.human.skin", "folds") if row["fold"] == "nasolabial"]
    fold_x, fold_y, _ = float_columns(knots, "x y z").T
    beside = (x - np.interp(-y, -fold_y, fold_x)) / _FOLD_WIDTH_MM
    low, high = _LID_HEIGHTS_MM
    weight = _smoothstep(beside) * _smoothstep((high - y) / (high - low)) * (z > 0.0)
    offsets = np.array([x, y]).T - _APPLE_MM
    weight *= np.exp(-((offsets / _HALF_SIZE_MM) ** 2).sum(axis=1))
    weight /= weight.max()
    kept = weight > _MIN_DISPLACEMENT
    return skin[kept], weight[kept]


def _smoothstep(value: Points) -> Points:
    clipped = np.clip(value, 0.0, 1.0)
    return np.asarray(clipped * clipped * (3.0 - 2.0 * clipped))
