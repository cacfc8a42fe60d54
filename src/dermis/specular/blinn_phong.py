"""Blinn-Phong lobes: the original highlight, and a normalised BRDF that conserves energy."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.models import SpecularModel


def blinn_phong_exponent(m: ArrayLike) -> Floats:
    """Return the exponent s = 2 / m^2 - 2 of the Blinn-Phong lobe that is as wide as a Beckmann lobe [-].

    m : roughness of the Beckmann lobe [-]

    Source: [Walter2007] section 5.2.
    """
    return np.asarray(2.0 / np.asarray(m, dtype=np.float64) ** 2 - 2.0)


def blinn_phong(cosines: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """Return the normalised Blinn-Phong BRDF F (s + 2) / (8 pi) (n.h)^s [1/sr].

    m : roughness, from which `blinn_phong_exponent` yields s; broadcast against the cosines [-]
    fresnel : function that returns F from the cosine v.h

    The factor (s + 2) / (8 pi) is a quarter of the factor (s + 2) / (2 pi), which normalises the slope
    distribution. The BRDF contains neither masking nor a division by n.l n.v. It therefore fades at grazing
    angles, unlike the specular reflection of skin.

    Source: [Blinn1977]; the distribution as normalised in [Walter2007] section 5.2.
    """
    s = blinn_phong_exponent(m)
    lobe = fresnel(cosines.v_h) * (s + 2.0) / (8.0 * np.pi) * _power_of_n_h(cosines, s)
    return np.asarray(np.where(cosines.is_above, lobe, 0.0))


def blinn_phong_plain(cosines: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """Return the BRDF F (n.h)^s / (pi n.l) of the original Blinn-Phong highlight [1/sr].

    m : roughness, from which `blinn_phong_exponent` yields s; broadcast against the cosines [-]
    fresnel : function that returns F from the cosine v.h

    The original highlight F (n.h)^s was not multiplied by n.l, so its BRDF contains 1 / n.l and is not
    reciprocal. Early renderers added the highlight to a diffuse term without the factor 1/pi; here both terms
    have this factor.

    Source: [Blinn1977].
    """
    lobe = (
        fresnel(cosines.v_h)
        * _power_of_n_h(cosines, blinn_phong_exponent(m))
        / (np.pi * np.maximum(cosines.n_l, 1e-6))
    )
    return np.asarray(np.where(cosines.is_above, lobe, 0.0))


def _power_of_n_h(cosines: Cosines, exponent: Floats) -> Floats:
    return np.asarray(np.clip(cosines.n_h, 0.0, 1.0) ** exponent)


BLINN_PHONG = SpecularModel(
    blinn_phong, "normalised power of n.h", reciprocal=True, sources=("Blinn1977", "Walter2007")
)
BLINN_PHONG_PLAIN = SpecularModel(
    blinn_phong_plain,
    "original power of n.h; not reciprocal, as its highlight lacks the cosine of the light",
    reciprocal=False,
    sources=("Blinn1977",),
)
