"""A stack of slabs: light to and fro between them, added up frequency by frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.diffusion import multipole
from dermis.optics.diffusion.multipole import Clamp, Slab
from dermis.optics.media import Floats, Medium


@dataclass(frozen=True)
class Response:
    """Hankel transforms, (n, c) each, of what a stack does to light from above and from below [-]."""

    R_above: Floats
    T_down: Floats
    R_below: Floats
    T_up: Floats

    def over(self, lower: Response) -> Response:
        """This stack on top of another.

        Source: [DonnerJensen2005] section 3.3, after Kubelka's addition of layers.
        """
        between = 1.0 / (1.0 - self.R_below * lower.R_above)
        return Response(
            self.R_above + self.T_down * lower.R_above * between * self.T_up,
            self.T_down * between * lower.T_down,
            lower.R_below + lower.T_up * self.R_below * between * lower.T_down,
            lower.T_up * between * self.T_up,
        )


def respond(frequency: ArrayLike, medium: Medium, A: float, clamp: Clamp = "layer") -> Response:
    """The response of all layers by frequency s [1/mm].

    A : boundary mismatch against the air, above and below; inner faces are index-matched [-]
    clamp : where the source of a layer thinner than a mean free path goes, see `Slab`
    """
    slabs = slabs_of(medium, A, clamp)
    stack = _one(frequency, slabs[-1])
    for slab in reversed(slabs[:-1]):
        stack = _one(frequency, slab).over(stack)
    return stack


def slabs_of(medium: Medium, A: float, clamp: Clamp = "layer") -> list[Slab]:
    """The medium's layers with their faces."""
    last = len(medium.layers) - 1
    return [
        Slab(layer, A if i == 0 else 1.0, A if i == last else 1.0, clamp)
        for i, layer in enumerate(medium.layers)
    ]


def _one(frequency: ArrayLike, slab: Slab) -> Response:
    below = slab.flipped()
    R_above, T_down = (
        multipole.reflectance_hankel(frequency, slab),
        multipole.transmittance_hankel(frequency, slab),
    )
    if np.isinf(slab.layer.thickness_mm):  # nothing comes from below
        return Response(R_above, T_down, np.zeros_like(R_above), np.zeros_like(R_above))
    return Response(
        R_above,
        T_down,
        multipole.reflectance_hankel(frequency, below),
        multipole.transmittance_hankel(frequency, below),
    )
