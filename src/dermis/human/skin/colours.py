"""Cached tables of skin colours as functions of melanin and blood."""

from __future__ import annotations

from functools import lru_cache
from threading import Lock

from dermis.optics.bands import Bands
from dermis.optics.pigments.parameters import SkinParameters
from dermis.optics.skin_colours import ColourTable, colour_table

_COLOUR_TABLE_LOCK = Lock()  # two threads may request the same table


def skin_colour_table(
    eumelanin: float, oxygen: float, epidermis_mm: float, bands: Bands | None = None
) -> ColourTable:
    """Return a table of skin colours over melanin and blood, for fixed values of the other parameters.

    bands : wavelengths in the place of red, green and blue
    """
    with _COLOUR_TABLE_LOCK:
        return _cached_colour_table(eumelanin, oxygen, epidermis_mm, bands)


@lru_cache(maxsize=64)
def _cached_colour_table(
    eumelanin: float, oxygen: float, epidermis_mm: float, bands: Bands | None
) -> ColourTable:
    parameters = SkinParameters(eumelanin=eumelanin, oxygen=oxygen, epidermis_mm=epidermis_mm)
    return colour_table(parameters, bands=bands)
