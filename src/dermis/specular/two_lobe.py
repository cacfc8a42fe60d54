"""Two lobes of two roughnesses, as engines shade skin today, off one surface that masks itself."""

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
"""Factors of m: an engine's 0.75 and 1.3 belong to its roughness, whose square is m [EpicGames2025]."""

NARROW_WEIGHT = 0.85
"""Weight of the narrow lobe, the rest is the wide one's [-] [EpicGames2025]."""

MIN_ROUGHNESS, MAX_ROUGHNESS = 0.05, 1.0


def two_lobe(angles: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """BRDF of a random surface with slopes of two kinds about m: a sharp core in a wide veil [1/sr].

    m : roughness, broadcast against the angles [-]; both kinds' stay within 0.05 to 1

    Source: [EpicGames2025] for the two; [Walter2007] section 5 for the lobe.
    """
    slopes = _mean(lambda rough: beckmann(angles.n_h, rough), m)
    return masked_lobe(angles, slopes, fresnel, lambda cosine: two_lobe_masking(cosine, m))


def two_lobe_masking(cos_theta: ArrayLike, m: ArrayLike) -> Floats:
    """Share of the facets seen from a direction, G1 [-].

    Smith's integral, 1 / G1 - 1, is linear in the distribution of slopes: 1 / G1 mixes as they do.
    """
    return np.asarray(1.0 / _mean(lambda rough: 1.0 / smith_masking(cos_theta, rough), m))


def _mean(quantity: Callable[[Floats], Floats], m: ArrayLike) -> Floats:
    """Of both kinds of slopes, by their weights."""
    narrow, wide = (
        np.clip(factor * np.asarray(m), MIN_ROUGHNESS, MAX_ROUGHNESS)
        for factor in (NARROW_FACTOR, WIDE_FACTOR)
    )
    return np.asarray(NARROW_WEIGHT * quantity(narrow) + (1.0 - NARROW_WEIGHT) * quantity(wide))


TWO_LOBE = Model(
    two_lobe,
    "a narrow and a wide kind of slopes, masked after Smith",
    reciprocal=True,
    sources=("EpicGames2025", "Smith1967", "Walter2007", "Beckmann1963"),
    numbers={"narrow": NARROW_FACTOR, "wide": WIDE_FACTOR, "narrow_weight": NARROW_WEIGHT},
)
