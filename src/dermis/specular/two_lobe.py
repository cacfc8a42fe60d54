"""Two-lobe model of game engines: two roughnesses with common masking."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from dermis.specular.beckmann import beckmann
from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.models import Model
from dermis.specular.torrance_sparrow import masked_lobe, smith_masking

NARROW_FACTOR, WIDE_FACTOR = 0.75**2, 1.3**2
"""Factors of m of both lobes; the engine's 0.75 and 1.3 apply to the root of m [EpicGames2025]."""

NARROW_WEIGHT = 0.85
"""Weight of the narrow lobe; that of the wide lobe is the rest [-] [EpicGames2025]."""

MIN_ROUGHNESS, MAX_ROUGHNESS = 0.05, 1.0


def two_lobe(angles: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """Return the BRDF of a mixture of a narrow and a wide Beckmann slope distribution [1/sr].

    m : roughness, broadcast against the angles [-]; those of both lobes are clamped to 0.05 to 1

    Source: [EpicGames2025] for the two lobes; [Walter2007] section 5 for the BRDF.
    """
    slopes = _mean(lambda rough: beckmann(angles.n_h, rough), m)
    return masked_lobe(angles, slopes, fresnel, lambda cosine: two_lobe_masking(cosine, m))


def two_lobe_masking(cos_theta: ArrayLike, m: ArrayLike) -> Floats:
    """Return the visible fraction of facets G1 in a direction [-].

    Smith's 1 / G1 - 1 is an integral over the slope distribution, so 1 / G1 is mixed like the distributions.
    """
    return np.asarray(1.0 / _mean(lambda rough: 1.0 / smith_masking(cos_theta, rough), m))


def _mean(quantity: Callable[[Floats], Floats], m: ArrayLike) -> Floats:
    """Return the weighted mean of a quantity for the roughnesses of both lobes."""
    factors = NARROW_FACTOR, WIDE_FACTOR
    narrow, wide = (np.clip(factor * np.asarray(m), MIN_ROUGHNESS, MAX_ROUGHNESS) for factor in factors)
    return np.asarray(NARROW_WEIGHT * quantity(narrow) + (1.0 - NARROW_WEIGHT) * quantity(wide))


TWO_LOBE = Model(
    two_lobe,
    "narrow and wide Beckmann distributions with Smith masking",
    reciprocal=True,
    sources=("EpicGames2025", "Smith1967", "Walter2007", "Beckmann1963"),
    numbers={"narrow": NARROW_FACTOR, "wide": WIDE_FACTOR, "narrow_weight": NARROW_WEIGHT},
)
