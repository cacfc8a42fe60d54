"""Phong lobes: the original highlight, and a normalised BRDF that conserves energy."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.specular.blinn_phong import blinn_phong_exponent
from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.models import SpecularModel


def phong(cosines: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """Return the Phong BRDF F (s + 2) / (2 pi) (r.v)^s [1/sr].

    The vector r is the light direction mirrored at the normal. The factor (s + 2) / (2 pi) makes the lobe
    reflect the fraction F at normal incidence.

    m : roughness; s is a quarter of `blinn_phong_exponent(m)`, as r rotates twice as far as the half vector
    fresnel : function that returns F from the cosine v.h; this cosine keeps the BRDF reciprocal

    Source: [LafortuneWillems1994].
    """
    s = 0.25 * blinn_phong_exponent(m)
    lobe = fresnel(cosines.v_h) * (s + 2.0) / (2.0 * np.pi) * _power_of_r_v(cosines, s)
    return np.asarray(np.where(cosines.is_above, lobe, 0.0))


def phong_plain(cosines: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """Return the BRDF W(i) (r.v)^s / (pi n.l) of the original Phong highlight [1/sr].

    Here r is the light direction mirrored at the normal, and W(i) is the Fresnel reflectance at the angle of
    incidence i. Because of W(i) and the division by n.l, the BRDF is not reciprocal. Phong added the
    highlight to a diffuse term without the factor 1/pi; here both terms have this factor.

    m : roughness; s is a quarter of `blinn_phong_exponent(m)`
    fresnel : function that returns W(i) from the cosine n.l of the angle i

    Source: [Phong1975].
    """
    n_l = np.maximum(cosines.n_l, 1e-6)
    lobe = fresnel(n_l) * _power_of_r_v(cosines, 0.25 * blinn_phong_exponent(m)) / (np.pi * n_l)
    return np.asarray(np.where(cosines.is_above, lobe, 0.0))


def _power_of_r_v(cosines: Cosines, exponent: Floats) -> Floats:
    """Return (r.v)^exponent, where r is the light direction mirrored at the normal."""
    r_v = 2.0 * cosines.n_l * cosines.n_v - (2.0 * cosines.v_h**2 - 1.0)
    return np.asarray(np.clip(r_v, 0.0, 1.0) ** exponent)


PHONG = SpecularModel(
    phong, "normalised power of r.v", reciprocal=True, sources=("Phong1975", "LafortuneWillems1994")
)
PHONG_PLAIN = SpecularModel(
    phong_plain,
    "original power of r.v; not reciprocal, as its highlight lacks the cosine of the light and its "
    "Fresnel reflectance is that of the angle of incidence",
    reciprocal=False,
    sources=("Phong1975",),
)
