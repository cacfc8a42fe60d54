"""Light finer than the atlas' texels: what texels average of it, and the levels that show it whole."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FINE_LEVELS = 8
"""Narrowest levels that are made whole in the picture; wider ones, texels hold as they are."""
TEXEL_AREA = 0.5
"""Standard deviation of what a texel averages [texel]: little is left to beat with their grid."""


def fine_numbers() -> dict[str, float]:
    """Numbers that fine_light.wgsl fills in."""
    return {"fine_levels": FINE_LEVELS}


def fine_levels(
    variance_mm2: NDArray[np.float64], weight: NDArray[np.float64], relit_mm2: float
) -> dict[str, Any]:
    """Members of the shader's struct Fine.

    variance_mm2, weight : (k,) and (k, 3) of the blurred levels
    relit_mm2 : variance of the level that is not blurred
    """
    count = min(len(variance_mm2), FINE_LEVELS)
    level = np.zeros((FINE_LEVELS, 4), np.float32)
    level[:count, :3], level[:count, 3] = weight[:count], variance_mm2[:count]
    return {"count": count, "texel_variance": TEXEL_AREA**2, "relit_mm2": relit_mm2, "level": level}
