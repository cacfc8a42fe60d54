"""Two-lobe model of game engines: a narrow and a wide Beckmann lobe that share one Smith masking function."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from dermis.specular.beckmann import beckmann
from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.models import SpecularModel
from dermis.specular.torrance_sparrow import masked_lobe, smith_masking

NARROW_FACTOR, WIDE_FACTOR = 0.75**2, 1.3**2
"""Roughness of the narrow and of the wide lobe, divided by m [-]; the engine applies 0.75 and 1.3 to the root
of m [EpicGames2025]."""

NARROW_WEIGHT = 0.85
"""Weight of the narrow lobe; the wide lobe has the weight 1 - NARROW_WEIGHT [-] [EpicGames2025]."""

MIN_ROUGHNESS, MAX_ROUGHNESS = 0.05, 1.0


def two_lobe(cosines: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """Return the BRDF of a mixture of a narrow and a wide Beckmann slope distribution [1/sr].

    m : roughness, broadcast against the cosines; the roughnesses of the two lobes are NARROW_FACTOR m and
        WIDE_FACTOR m, clamped to the range 0.05 to 1 [-]
    fresnel : function that returns the Fresnel reflectance from the cosine v.h

    Source: [EpicGames2025] for the two lobes; [Walter2007] section 5 for the BRDF.
    """
    slopes = _weighted_lobe_mean(lambda rough: beckmann(cosines.n_h, rough), m)
    return masked_lobe(cosines, slopes, fresnel, lambda cosine: two_lobe_masking(cosine, m))


def two_lobe_masking(cos_theta: ArrayLike, m: ArrayLike) -> Floats:
    """Return the masking G1 of the two-lobe mixture, the fraction of facets visible from a direction [-].

    In Smith's model, 1 / G1 - 1 is an integral over the slope distribution. The 1 / G1 of the mixture is
    therefore the mean of the 1 / G1 of both lobes, with the weights of the lobes.

    cos_theta : cosine of the angle between the direction and the normal
    m : roughness of the model, from which the roughnesses of the two lobes are computed [-]
    """
    return np.asarray(1.0 / _weighted_lobe_mean(lambda rough: 1.0 / smith_masking(cos_theta, rough), m))


def _weighted_lobe_mean(lobe_quantity: Callable[[Floats], Floats], roughness: ArrayLike) -> Floats:
    """Return the mean of a quantity over the narrow and the wide lobe, with the weights of the lobes.

    lobe_quantity : function that returns the quantity from the roughness of a lobe
    roughness : roughness of the model [-]
    """
    factors = NARROW_FACTOR, WIDE_FACTOR
    narrow, wide = (
        np.clip(factor * np.asarray(roughness), MIN_ROUGHNESS, MAX_ROUGHNESS) for factor in factors
    )
    return np.asarray(NARROW_WEIGHT * lobe_quantity(narrow) + (1.0 - NARROW_WEIGHT) * lobe_quantity(wide))


TWO_LOBE = SpecularModel(
    two_lobe,
    "narrow and wide Beckmann distributions with Smith masking",
    reciprocal=True,
    sources=("EpicGames2025", "Smith1967", "Walter2007", "Beckmann1963"),
    numbers={"narrow": NARROW_FACTOR, "wide": WIDE_FACTOR, "narrow_weight": NARROW_WEIGHT},
    lobes=(NARROW_FACTOR, WIDE_FACTOR, NARROW_WEIGHT),
)
