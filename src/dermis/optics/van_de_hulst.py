"""Colour and albedo of half-spaces of the index of the air, as renderers turn one into the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.media import Floats


def albedo_of_colour(colour: ArrayLike, g: float = 0.0) -> Floats:
    """Albedo of single scattering with which a half-space returns a colour, of its shape [-].

    g : mean cosine of the deflection [-]

    Source: van de Hulst's formula inverted, [dEon2022] eq. 53.7.
    """
    C = np.clip(np.asarray(colour, np.float64), 0.0, 1.0)
    s = 4.09712 + 4.20863 * C - np.sqrt(9.59217 + 41.6808 * C + 17.7126 * C**2)
    s = np.clip(s, 0.0, 1.0)
    return np.asarray((1.0 - s**2) / (1.0 - g * s**2))


def colour_of_albedo(albedo: ArrayLike, g: float = 0.0) -> Floats:
    """Share of diffuse light that a half-space returns, of the albedo's shape [-].

    g : mean cosine of the deflection [-]

    Source: van de Hulst's formula, [dEon2022].
    """
    alpha = np.asarray(albedo, np.float64)
    s = np.sqrt((1.0 - alpha) / (1.0 - alpha * g))
    return np.asarray((1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s))
