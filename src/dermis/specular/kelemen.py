"""Kelemen and Szirmay-Kalos lobe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from dermis.specular.beckmann import beckmann
from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.models import Model


def kelemen(angles: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """Return the BRDF for rho_s = 1, without the cosine [1/sr].

    m : roughness, broadcast against the angles [-]

    f = D F / (h.h) with the unnormalised h = l + v, so h.h = 4 (v.h)^2 of the unit half vector. The published
    lobe omits the 1/pi of the Beckmann distribution, as its diffuse term does; here both have it, so their
    ratio is the published one.

    Source: [Kelemen2001]; [dEonLuebke2007] section 14.3.
    """
    h2 = np.maximum(4.0 * angles.v_h**2, 1e-12)
    lobe = beckmann(angles.n_h, m) * fresnel(angles.v_h) / (np.pi * h2)
    return np.asarray(np.where(angles.above, lobe, 0.0))


KELEMEN = Model(
    kelemen,
    "Beckmann distribution over the squared length of l + v, evaluated with a table",
    reciprocal=True,
    sources=("Kelemen2001", "Beckmann1963"),
)
KELEMEN_DIRECT = replace(KELEMEN, note="the model kelemen, evaluated without its table")
