"""Blinn's highlight around the half vector, as first used and with its energy put right."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.models import Model


def exponent(m: ArrayLike) -> Floats:
    """The power s of a cosine lobe that is as wide as Beckmann's of roughness m: 2 / m^2 - 2 [-].

    Source: [Walter2007] section 5.2.
    """
    return np.asarray(2.0 / np.asarray(m, dtype=np.float64) ** 2 - 2.0)


def blinn_phong(angles: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """BRDF F (s + 2) / 8 pi (n.h)^s [1/sr].

    m : roughness, broadcast against the angles [-]

    The factor is that of a normalised distribution of slopes over 4; without shadowing or the division by
    both cosines the lobe fades at grazing angles, where skin does not.

    Source: [Blinn1977]; the distribution as normalised in [Walter2007] section 5.2.
    """
    s = exponent(m)
    lobe = fresnel(angles.v_h) * (s + 2.0) / (8.0 * np.pi) * _power(angles, s)
    return np.asarray(np.where(angles.above, lobe, 0.0))


def blinn_phong_plain(angles: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """The highlight F (n.h)^s of old pipelines as a BRDF: divided by the cosine that it does not have [1/sr].

    The division makes it not reciprocal. It was added to a diffuse term without 1/pi; both are divided by
    pi here.

    Source: [Blinn1977].
    """
    lobe = fresnel(angles.v_h) * _power(angles, exponent(m)) / (np.pi * np.maximum(angles.n_l, 1e-6))
    return np.asarray(np.where(angles.above, lobe, 0.0))


def _power(angles: Cosines, s: Floats) -> Floats:
    return np.asarray(np.clip(angles.n_h, 0.0, 1.0) ** s)


BLINN_PHONG = Model(
    blinn_phong,
    "a power of n.h with its energy put right",
    reciprocal=True,
    sources=("Blinn1977", "Walter2007"),
)
BLINN_PHONG_PLAIN = Model(
    blinn_phong_plain,
    "a power of n.h as first used; not reciprocal, for its highlight has no cosine of the light",
    reciprocal=False,
    sources=("Blinn1977",),
)
