"""Two lobes of two roughnesses, as engines shade skin today."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.kelemen import kelemen
from dermis.specular.models import Model

NARROW, WIDE = 0.75**2, 1.3**2
"""Factors of m: an engine's 0.75 and 1.3 belong to its roughness, whose square is m [EpicGames2025]."""

SHARE_OF_NARROW = 0.85
"""Weight of the narrow lobe, the rest is the wide one's [-] [EpicGames2025]."""

LEAST_M, MOST_M = 0.05, 1.0


def two_lobe(angles: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """BRDF of two Kelemen lobes about the roughness m: a sharp core in a wide veil [1/sr].

    m : roughness, broadcast against the angles [-]; both lobes' stay within 0.05 to 1
    """
    narrow, wide = (np.clip(factor * np.asarray(m), LEAST_M, MOST_M) for factor in (NARROW, WIDE))
    core, veil = kelemen(angles, narrow, fresnel), kelemen(angles, wide, fresnel)
    return np.asarray(SHARE_OF_NARROW * core + (1.0 - SHARE_OF_NARROW) * veil)


TWO_LOBE = Model(
    two_lobe,
    "a narrow and a wide Kelemen lobe",
    reciprocal=True,
    sources=("Kelemen2001", "Beckmann1963", "EpicGames2025"),
    numbers={"narrow": NARROW, "wide": WIDE, "share_of_narrow": SHARE_OF_NARROW},
)
