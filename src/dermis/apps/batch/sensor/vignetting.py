"""Vignetting: decrease of light towards the corners of a picture."""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Doubles, Floats


def vignetting_factors(K: Doubles, picture_size: tuple[int, int], strength: float) -> Floats:
    """Return the factor (h, w) of the light at each pixel: cos^(4 strength) of the ray's angle to the axis.

    K : (3, 3) intrinsic matrix of the camera [pixel]
    picture_size : width and height [pixel]
    strength : 1 for the natural vignetting of a thin lens [-]

    Source: [Gardner1947].
    """
    width, height = picture_size
    x = (np.arange(width) - K[0, 2]) / K[0, 0]
    y = (np.arange(height) - K[1, 2]) / K[1, 1]
    squared_secant = 1.0 + x[None, :] ** 2 + y[:, None] ** 2
    return np.asarray(squared_secant ** (-2.0 * strength), np.float32)
