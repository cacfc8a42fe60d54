"""Specular lobe of Kelemen and Szirmay-Kalos with Beckmann slopes, as in the published skin shader."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from dermis.specular.beckmann import beckmann
from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.models import SpecularModel


def kelemen(cosines: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """Return the BRDF D F / (4 pi (v.h)^2) of specular strength rho_s = 1, without the factor n.l [1/sr].

    m : roughness of the Beckmann distribution D; broadcast against the cosines [-]
    fresnel : function that returns F from the cosine v.h

    The denominator equals pi |l + v|^2. The published shader omits the factor 1/pi in both the Beckmann
    distribution and the diffuse term; here both have it, so their ratio is as published.

    Source: [Kelemen2001]; [dEonLuebke2007] section 14.3.
    """
    h2 = np.maximum(4.0 * cosines.v_h**2, 1e-12)
    lobe = beckmann(cosines.n_h, m) * fresnel(cosines.v_h) / (np.pi * h2)
    return np.asarray(np.where(cosines.is_above, lobe, 0.0))


KELEMEN = SpecularModel(
    kelemen,
    "Beckmann distribution over the squared length of l + v, evaluated with a table",
    reciprocal=True,
    sources=("Kelemen2001", "Beckmann1963"),
)
KELEMEN_DIRECT = replace(KELEMEN, note="the model kelemen, evaluated without its table")
