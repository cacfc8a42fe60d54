"""Skin maps that the device paints from a skin look, and mean colours of face and lips."""

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
    """Return the table of skin colours by melanin and blood fraction; tables are cached."""
    with _LOCK:
        return _cached_colour_table(eumelanin, oxygen, epidermis_mm)


@lru_cache(maxsize=64)
def _cached_colour_table(eumelanin: float, oxygen: float, epidermis_mm: float) -> ColourTable:
    return colour_table(SkinParameters(eumelanin=eumelanin, oxygen=oxygen, epidermis_mm=epidermis_mm))


def mean_colour(look: SkinLook) -> NDArray[np.float64]:
    """Return the colour (3,) of skin that has the mean pigments of a look everywhere, linear Rec. 709 [-]."""
    table = skin_colour_table(look.eumelanin, look.oxygen, DEFAULT_SKIN.epidermis_mm)
    return np.asarray(table.lookup(np.array([look.melanin]), np.array([look.blood]))[0])


def face_and_lip_colours(look: SkinLook) -> NDArray[np.float32]:
    """Return the colour tables (2, n, n, 3) of face and lips by pigment fractions, as in `ColourTable`."""
    thick = DEFAULT_SKIN.epidermis_mm, LIP_EPIDERMIS_MM
    both = [skin_colour_table(look.eumelanin, look.oxygen, mm).colours for mm in thick]
    return np.stack(both).astype(np.float32)


@dataclass(frozen=True, repr=False)
class PaintedMaps(Maps):
    """Skin maps that the device paints from a skin look, except for maps that are given.

    look : pigments and texture of the skin
    """

    look: SkinLook = field(default_factory=SkinLook)
    is_painted: ClassVar[bool] = True

    @property
    def has_roughness(self) -> bool:
        """Return True, as a roughness map is painted if none is given."""
        return True

    @cached_property
    def mean_colour(self) -> NDArray[np.float64] | None:
        """Return the mean colour (3,) of the colour map, or of the look without one, linear Rec. 709 [-]."""
        return super().mean_colour if self.colour is not None else mean_colour(self.look)
