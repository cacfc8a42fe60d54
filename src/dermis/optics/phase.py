"""Scattering that goes forward, by the cosines of directions, as what slabs are added up from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Phase:
    """How a medium scatters, all azimuths together.

    What is scattered straight on counts as not: a medium that scatters less stands for the true one.

    albedo : of single scattering of that medium [-]
    extinction, whole_extinction : of that medium and of the true one, over the reduced extinction [-]
    backward, forward : (m, m) from cosines to cosines, to the other side of the horizon and to the same; 1
        where light scatters alike in all directions [-]
    """

    albedo: float
    extinction: float
    whole_extinction: float
    backward: Floats
    forward: Floats


def phase(albedo: float, g: float, cosine: Floats, terms: int) -> Phase:
    """The scattering of Henyey and Greenstein, by polynomials of Legendre.

    albedo : reduced [-]
    g : mean cosine, 0 or more, under 1 [-]
    cosine : (m,) of directions
    terms : of the series; the rest goes straight on

    Sources: [HenyeyGreenstein1941]; [Wiscombe1977] for what goes straight on.
    """
    whole = 1.0 + albedo * g / (1.0 - g)
    single, straight = albedo / ((1.0 - g) * whole), g**terms
    order = np.arange(terms)
    moment = (2.0 * order + 1.0) * (g**order - straight) / (1.0 - straight)
    P = np.polynomial.legendre.legvander(cosine, terms - 1)
    left = 1.0 - straight * single
    return Phase(
        albedo=(1.0 - straight) * single / left,
        extinction=left * whole,
        whole_extinction=whole,
        backward=(P * moment * (-1.0) ** order) @ P.T,
        forward=(P * moment) @ P.T,
    )
