"""Colour of the skin from its pigments, and strength and roughness of its surface reflection."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dermis.human.bust.fields import Doubles
from dermis.human.skin_maps.look import SkinLook
from dermis.optics.pigments.skin import SkinParameters
from dermis.optics.skin_colours import ColourTable, colour_table

EPIDERMIS_MM = 0.05
"""Thickness of the epidermis of the face, an artist's value within what is measured, 0.05 to 0.1 [mm]."""
LIP_EPIDERMIS_MM = 0.03
"""What stands over the blood of the lips, which shows through more than elsewhere [mm]."""

# Hair of light and of dark skin, an artist's values, linear Rec. 709.
_BROWN, _BLACK = np.array([0.060, 0.033, 0.018]), np.array([0.012, 0.009, 0.008])
_STUBBLE = np.array([0.095, 0.085, 0.08])  # seen through skin, which makes it blueish
_BLACK_AT = 0.08  # melanin of a skin whose hair is black
# Artist's values: measured ones by face region exist [Weyrich2006], but not in a form that can be used here.
# They keep near what real-time skin has been given by hand, rho_s 0.18 and m 0.3 [dEonLuebke2007].
_STRENGTH, _OILY_STRENGTH = 0.155, 0.08
_ROUGHNESS, _OILY_ROUGHNESS = 0.36, -0.10
_LIP_STRENGTH, _LIP_ROUGHNESS = 0.05, -0.07
_UNEVEN = 0.15  # of the oil
_LEAST_STRENGTH, _MOST_STRENGTH = 0.05, 0.45
_LEAST_ROUGHNESS, _MOST_ROUGHNESS = 0.15, 0.6


def colour_of(look: SkinLook, pigments: Doubles, place: Doubles, mark: Doubles) -> NDArray[np.float32]:
    """Colours (n, 3), linear Rec. 709 [-].

    pigments : (n, 2) shares of melanin and of blood [-]
    place, mark : (n, columns) as the kernels give them
    """
    from dermis.human.skin_maps.kernels.marks import HAIR, STUBBLE
    from dermis.human.skin_maps.kernels.places import LIP

    skin, lips = _tables(look.eumelanin, look.oxygen)
    colour = skin.read(*pigments.T)
    red = place[:, LIP] > 0
    colour[red] += place[red, LIP, None] * (lips.read(*pigments[red].T) - colour[red])
    for share, over in ((mark[:, STUBBLE], _STUBBLE), (mark[:, HAIR], _hair_colour(look))):
        hidden = share > 0
        # what is dark already does not turn lighter
        colour[hidden] += share[hidden, None] * (np.minimum(over, colour[hidden]) - colour[hidden])
    return colour.astype(np.float32)


def _hair_colour(look: SkinLook) -> Doubles:
    dark = min(look.melanin / _BLACK_AT, 1.0)
    return np.asarray(_BROWN + dark * (_BLACK - _BROWN))


@lru_cache(maxsize=4)
def _tables(eumelanin: float, oxygen: float) -> tuple[ColourTable, ColourTable]:
    lips = SkinParameters(eumelanin=eumelanin, oxygen=oxygen, epidermis_mm=LIP_EPIDERMIS_MM)
    return face_colours(eumelanin, oxygen), colour_table(lips)


@lru_cache(maxsize=4)
def face_colours(eumelanin: float, oxygen: float) -> ColourTable:
    """Colour of the skin of the face by its shares of melanin and of blood."""
    return colour_table(SkinParameters(eumelanin=eumelanin, oxygen=oxygen, epidermis_mm=EPIDERMIS_MM))


def gloss(look: SkinLook, place: Doubles, mark: Doubles) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """rho_s and m (n,) [-]: oilier in the middle of the face and on the lips, weaker in pores and on hair.

    place, mark : (n, columns) as the kernels give them
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
