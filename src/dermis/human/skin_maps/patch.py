"""A piece of skin that is painted at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]


class Patch(NamedTuple):
    """Places on the skin, as the compiled loops take them.

    points : (n, 3) [mm]
    normals : (n, 3) unit normals of the smooth surface
    texel_mm : (n,) how far apart the places around each are [mm]
    seed : where the random numbers of all textures begin
    """

    points: Doubles
    normals: Doubles
    texel_mm: Doubles
    seed: int
