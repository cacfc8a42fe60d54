"""Tables of what thin parts of the skin let pass and return less, as a frame needs them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dermis.frame import surface
from dermis.frame.asked import Asked
from dermis.frame.levels import LEAST_WEIGHT
from dermis.gpu import Memo
from dermis.optics.flesh import medium_of
from dermis.optics.gaussians import GaussianSum
from dermis.optics.thin_parts import ThinParts, thin_parts

Floats = NDArray[np.float64]
_REACH, _FARTHEST_MM = 4.0, 40.0  # standard deviations of the widest Gaussian, beyond all pairs


def thin_tables(memo: Memo, asked: Asked) -> ThinParts | None:
    """What passes thin parts of half-spaces, for the blurred levels; None for lambertian skin."""
    if asked.skin.direction != "half-space":
        return None
    split, law = asked.split, surface.half_space_of(asked.skin, asked.head.maps, asked.profile)
    g = asked.skin.anisotropy
    return memo.keep(_made, asked.profile, *law, g, split.total, split.blurred_mm2, split.weight)


def _made(
    profile: GaussianSum,
    colour: Floats,
    eta: float,
    g: float,
    total: Floats,
    variance_mm2: Floats,
    weight: Floats,
) -> ThinParts:
    """Tables as weights of the blurred levels, which alone lose what passes: no more than they have."""
    reach = min(_REACH * float(np.sqrt(variance_mm2[-1])), _FARTHEST_MM)
    made = thin_parts(medium_of(profile, colour, eta), variance_mm2, reach, g)
    blurred = weight.sum(axis=0) / np.maximum(total, LEAST_WEIGHT)
    share = np.minimum(1.0, blurred / np.maximum(made.lost.sum(axis=1), LEAST_WEIGHT))[:, None]
    lost = made.lost * share / np.maximum(blurred, LEAST_WEIGHT)
    return replace(made, through=made.through * share * total, lost=lost)
