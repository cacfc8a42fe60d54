"""Strength and roughness of the surface's reflection, by place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.human.skin_maps.look import SkinLook
from dermis.human.skin_maps.patch import Doubles

# Artist's values: measured ones by face region exist [Weyrich2006], but not in a form that can be used here.
# They keep near what real-time skin has been given by hand, rho_s 0.18 and m 0.3 [dEonLuebke2007].
_STRENGTH, _OILY_STRENGTH = 0.155, 0.08
_ROUGHNESS, _OILY_ROUGHNESS = 0.36, -0.10
_LIP_STRENGTH, _LIP_ROUGHNESS = 0.05, -0.07
_UNEVEN = 0.15  # of the oil
_LEAST_STRENGTH, _MOST_STRENGTH = 0.05, 0.45
_LEAST_ROUGHNESS, _MOST_ROUGHNESS = 0.15, 0.6


def gloss(look: SkinLook, place: Doubles, mark: Doubles) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """rho_s and m (n,) [-]: oilier in the middle of the face and on the lips, weaker in pores and on hair.

    place, mark : (n, columns) as the compiled loops give them
    """
    from dermis.human.skin_maps.kernels.marks import FILM, HAIR, PORE
    from dermis.human.skin_maps.kernels.places import LIP, ROUGHNESS, STRENGTH

    zones = 0.5 + 1.25 * look.oil
    rho_s = _STRENGTH + _OILY_STRENGTH * look.oil + zones * place[:, STRENGTH] + _LIP_STRENGTH * place[:, LIP]
    rho_s *= (1.0 + _UNEVEN * mark[:, FILM]) * (1.0 - 0.5 * mark[:, PORE]) * (1.0 - 0.4 * mark[:, HAIR])
    m = _ROUGHNESS + _OILY_ROUGHNESS * look.oil + zones * place[:, ROUGHNESS] + _LIP_ROUGHNESS * place[:, LIP]
    m *= 1.0 - 0.5 * _UNEVEN * mark[:, FILM]
    return (
        np.clip(rho_s, _LEAST_STRENGTH, _MOST_STRENGTH).astype(np.float32),
        np.clip(m, _LEAST_ROUGHNESS, _MOST_ROUGHNESS).astype(np.float32),
    )
