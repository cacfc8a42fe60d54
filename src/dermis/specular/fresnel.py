"""Reflectance of the skin's surface by angle."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

SKIN_F0 = 0.028
"""Reflectance of skin at normal incidence, ((1.4 - 1) / (1.4 + 1))^2 rounded [-] [dEonLuebke2007]."""


def schlick(cos_theta: ArrayLike, f0: float = SKIN_F0) -> NDArray[np.float64]:
    """Fresnel reflectance at the angle between view and half vector [-]. Source: [Schlick1994]."""
    c = np.clip(np.asarray(cos_theta, dtype=np.float64), 0.0, 1.0)
    reflectance: NDArray[np.float64] = f0 + (1.0 - f0) * (1.0 - c) ** 5
    return reflectance
