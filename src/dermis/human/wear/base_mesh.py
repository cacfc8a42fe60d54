"""Vertices of MakeHuman's base mesh hm08, helpers included, on the bust of a person."""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Mask
from dermis.human.makehuman import mesh_point_count

if TYPE_CHECKING:
    from scipy.sparse import csr_array

OFFSET_UNIT_MM = 0.05
"""Unit of the offsets in the file of the package [mm]."""
WEIGHT_STEPS = 255
"""Sum of the weights in that file."""
_REACH_MM = 30.0  # distance from the skin of the bust up to which clothes are kept


class BaseMesh(NamedTuple):
    """Vertices of hm08, each on a triangle of the skin of the bust with a constant offset.

    weights : (19158, p) weights of the points of the bust
    offset_mm : (19158, 3) offsets [mm]
    """

    weights: csr_array
    offset_mm: Doubles

    @property
    def is_near(self) -> Mask:
        """Return the mask (19158,) of vertices near the skin of the bust."""
        return np.asarray(np.linalg.norm(self.offset_mm, axis=1) < _REACH_MM)


@cache
def base_mesh() -> BaseMesh:
    """Return the vertices of hm08."""
    from scipy.sparse import csr_array

    with resources.files("dermis.human.data").joinpath("hm08.npz").open("rb") as file, np.load(file) as data:
        point, weight, offset = (data[name] for name in ("point", "weight", "offset"))
    count = len(point)
    rows = np.repeat(np.arange(count), 3)
    values = weight.astype(np.float64).ravel() / WEIGHT_STEPS
    weights = csr_array((values, (rows, point.ravel().astype(np.int64))), shape=(count, mesh_point_count()))
    return BaseMesh(weights, OFFSET_UNIT_MM * offset.astype(np.float64))
