"""Torrance-Sparrow microfacet lobes: Beckmann slopes with V-cavity or Smith masking."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from dermis.specular.beckmann import beckmann
from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.models import SpecularModel

_MIN_COSINE = 1e-6


def torrance_sparrow(cosines: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """Return the BRDF D F G / (4 n.l n.v) with Beckmann's distribution D and V-cavity masking G [1/sr].

    m : roughness, broadcast against the cosines [-]
    fresnel : function that returns F from the cosine v.h

    Source: [TorranceSparrow1967]; masking in the form of [Blinn1977].
    """
    n_l, n_v = _clamped_cosines(cosines)
    groove = 2.0 * cosines.n_h * np.minimum(n_l, n_v) / np.maximum(cosines.v_h, _MIN_COSINE)
    return _microfacet_brdf(cosines, beckmann(cosines.n_h, m), fresnel, np.minimum(1.0, groove))


def torrance_sparrow_smith(cosines: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """Return the BRDF D F G1(l) G1(v) / (4 n.l n.v) with Smith masking G1 [1/sr].

    m : roughness of the Beckmann distribution D; broadcast against the cosines [-]
    fresnel : function that returns F from the cosine v.h

    Source: [Walter2007] section 5; [Smith1967].
    """
    return masked_lobe(cosines, beckmann(cosines.n_h, m), fresnel, lambda cosine: smith_masking(cosine, m))


def masked_lobe(
    cosines: Cosines,
    distribution_times_pi: Floats,
    fresnel: Fresnel,
    masking_function: Callable[[Floats], Floats],
) -> Floats:
    """Return the BRDF D F G1(l) G1(v) / (4 n.l n.v) for any distribution D and masking G1 [1/sr].

    distribution_times_pi : values of pi D, such as the result of `beckmann`
    fresnel : function that returns F from the cosine v.h
    masking_function : function that returns G1 from the cosine n.l or n.v
    """
    n_l, n_v = _clamped_cosines(cosines)
    return _microfacet_brdf(
        cosines, distribution_times_pi, fresnel, masking_function(n_l) * masking_function(n_v)
    )


def smith_masking(cos_theta: ArrayLike, m: ArrayLike) -> Floats:
    """Return Smith's masking G1, the fraction of facets visible from a direction [-].

    cos_theta : cosine of the angle between the direction and the normal
    m : roughness of Beckmann's slope distribution, for which G1 is exact [-]

    Source: [Smith1967]; [Walter2007] section 5.2, without the rational approximation given there.
    """
    from scipy.special import erf

    c = np.asarray(cos_theta, dtype=np.float64)
    a = c / (np.asarray(m, dtype=np.float64) * np.sqrt(np.maximum(1.0 - c**2, 1e-12)))
    return np.asarray(2.0 / (1.0 + erf(a) + np.exp(-(a**2)) / (a * np.sqrt(np.pi))))


def _clamped_cosines(cosines: Cosines) -> tuple[Floats, Floats]:
    """Return n.l and n.v, clamped to a small positive minimum to avoid divisions by 0."""
    return np.maximum(cosines.n_l, _MIN_COSINE), np.maximum(cosines.n_v, _MIN_COSINE)


def _microfacet_brdf(
    cosines: Cosines, distribution_times_pi: Floats, fresnel: Fresnel, masking_factor: Floats
) -> Floats:
    n_l, n_v = _clamped_cosines(cosines)
    lobe = distribution_times_pi / np.pi * fresnel(cosines.v_h) * masking_factor / (4.0 * n_l * n_v)
    return np.where(cosines.is_above, lobe, 0.0)


TORRANCE_SPARROW = SpecularModel(
    torrance_sparrow,
    "Beckmann distribution with V-cavity masking",
    reciprocal=True,
    sources=("TorranceSparrow1967", "CookTorrance1982", "Beckmann1963"),
)
TORRANCE_SPARROW_SMITH = SpecularModel(
    torrance_sparrow_smith,
    "Beckmann distribution with Smith masking",
    reciprocal=True,
    sources=("TorranceSparrow1967", "Smith1967", "Walter2007"),
)
