"""What walks over a surface need to know."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Ground(NamedTuple):
    """The surface as walks see it; sides are 01, 12, 20 of each triangle.

    flat : (f, 3, 2) corners of each triangle in its own plane, counter-clockwise from outside [mm]
    beside : (f, 3) triangle across each side, -1 where there is none
    entry : (f, 3) that triangle's side of this edge
    turned : (f, 3) whether that triangle faces the other way
    apex : (f, 3, 2) the third corner from each side's start, along and left of the side, in its lengths
    free : (f,) triangles that may be walked on
    """

    flat: NDArray[np.float64]
    beside: NDArray[np.int32]
    entry: NDArray[np.int8]
    turned: NDArray[np.bool_]
    apex: NDArray[np.float64]
    free: NDArray[np.bool_]
