"""Colour of the skin from its pigments."""

from __future__ import annotations

from functools import lru_cache

from dermis.optics.pigments.skin import SkinParameters
from dermis.optics.skin_colours import ColourTable, colour_table

EPIDERMIS_MM = 0.05
"""Thickness of the epidermis of the face, an artist's value within what is measured, 0.05 to 0.1 [mm]."""


@lru_cache(maxsize=4)
def face_colours(eumelanin: float, oxygen: float) -> ColourTable:
    """Colour of the skin of the face by its shares of melanin and of blood."""
    return colour_table(SkinParameters(eumelanin=eumelanin, oxygen=oxygen, epidermis_mm=EPIDERMIS_MM))
