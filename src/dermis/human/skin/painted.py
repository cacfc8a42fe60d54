"""Maps of skin painted from a look, and mean colours of face and lips."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from threading import Lock
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from dermis.human.skin.look import SkinLook
from dermis.mesh.maps import Maps
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters
from dermis.optics.skin_colours import ColourTable, colour_table

LIP_EPIDERMIS_MM = 0.03
"""Thickness of the epidermis of the lips, which is thinner than elsewhere [mm]."""
_LOCK = Lock()  # two threads may request the same table
MIN_SIDE, MAX_SIDE = 256, 4096
"""Sides of painted maps [texels]."""


def skin_colour_table(eumelanin: float, oxygen: float, epidermis_mm: float) -> ColourTable:
    """Return the table of skin colours by fractions of melanin and blood."""
    with _LOCK:
        return _cached_colour_table(eumelanin, oxygen, epidermis_mm)


@lru_cache(maxsize=64)
def _cached_colour_table(eumelanin: float, oxygen: float, epidermis_mm: float) -> ColourTable:
    return colour_table(SkinParameters(eumelanin=eumelanin, oxygen=oxygen, epidermis_mm=epidermis_mm))


def mean_colour(look: SkinLook) -> NDArray[np.float64]:
    """Return the colour (3,) of skin with mean pigments, linear Rec. 709 [-]."""
    table = skin_colour_table(look.eumelanin, look.oxygen, DEFAULT_SKIN.epidermis_mm)
    return np.asarray(table.lookup(np.array([look.melanin]), np.array([look.blood]))[0])


def face_and_lip_colours(look: SkinLook) -> NDArray[np.float32]:
    """Return the colours (2, n, n, 3) of face and lips, laid out as in `ColourTable`."""
    thick = DEFAULT_SKIN.epidermis_mm, LIP_EPIDERMIS_MM
    both = [skin_colour_table(look.eumelanin, look.oxygen, mm).colours for mm in thick]
    return np.stack(both).astype(np.float32)


@dataclass(frozen=True, repr=False)
class PaintedMaps(Maps):
    """Maps that the device paints from a look; given maps replace painted ones.

    look : pigments and texture of the skin
    """

    look: SkinLook = field(default_factory=SkinLook)
    is_painted: ClassVar[bool] = True

    @property
    def has_roughness(self) -> bool:
        """Return whether there is a roughness map, which is always painted."""
        return True

    @cached_property
    def mean_colour(self) -> NDArray[np.float64] | None:
        """Return the mean colour (3,) of the skin, linear Rec. 709 [-]."""
        return super().mean_colour if self.colour is not None else mean_colour(self.look)
