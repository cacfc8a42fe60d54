"""The surface lobe of skin after Kelemen and Szirmay-Kalos."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.specular.beckmann import beckmann
from dermis.specular.fresnel import SKIN_F0, schlick

Floats = NDArray[np.float64]


def kelemen(n: Floats, l: Floats, v: Floats, m: float, f0: float = SKIN_F0) -> Floats:
    """BRDF of the rough surface for rho_s = 1, without the cosine [1/sr].

    n, l, v : (..., 3) unit vectors: normal, to the light, to the eye
    m : roughness [-]

    f = D F / (h.h) with h = l + v not normalised. The published lobe leaves out the 1/pi of the Beckmann
    distribution, because its diffuse term does too; here both carry it, so their ratio is the published one.

    Source: [Kelemen2001]; [dEonLuebke2007] section 14.3.
    """
    h = l + v
    h2 = np.maximum((h * h).sum(-1), 1e-12)
    unit = h / np.sqrt(h2)[..., None]
    lobe: Floats = beckmann((n * unit).sum(-1), m) * schlick((v * unit).sum(-1), f0) / (np.pi * h2)
    return np.where(((n * l).sum(-1) > 0) & ((n * unit).sum(-1) > 0), lobe, 0.0)
