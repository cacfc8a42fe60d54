"""Skin maps that the GPU paints from a skin look, and mean colours of face and lips."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from dermis.human.skin.colours import skin_colour_table
from dermis.human.skin.face import lowest_zone_oxygen_change
from dermis.human.skin.look import SkinLook
from dermis.mesh.maps import Maps
from dermis.optics.bands import Bands

LIP_EPIDERMIS_THICKNESS_RATIO = 0.6
"""Thickness of the epidermis of the lips relative to the cheek [-]."""
_MIN_OXYGEN_RANGE = 1e-3
MIN_SIDE, MAX_SIDE = 256, 4096
"""Smallest and largest side of painted maps [texels]."""


def mean_colour(look: SkinLook, bands: Bands | None = None) -> NDArray[np.float64]:
    """Return the colour (3,) of skin that has the pigments of the cheek everywhere [-].

    bands : wavelengths of the channels; None for linear Rec. 709
    """
    table = skin_colour_table(look.eumelanin, look.oxygen, look.epidermis_mm, bands)
    return np.asarray(table.lookup(np.array([look.melanin]), np.array([look.blood]))[0])


def oxygen_range(skin_look: SkinLook) -> tuple[float, float]:
    """Return the lowest and the highest oxygen saturation of the skin of a head [-]."""
    differences = skin_look.sites.as_array()[:, 2]
    low, high = (
        skin_look.oxygen + float(one)
        for one in (min(differences.min(), 0.0) + lowest_zone_oxygen_change(), max(differences.max(), 0.0))
    )
    low = min(max(low, 0.0), 1.0 - _MIN_OXYGEN_RANGE)
    return low, max(min(high, 1.0), low + _MIN_OXYGEN_RANGE)


def painted_colour_tables(skin_look: SkinLook, bands: Bands | None = None) -> NDArray[np.float32]:
    """Return three colour tables (3, n, n, 3), indexed by pigment fractions as in `ColourTable`.

    The first two tables are for skin at the two ends of `oxygen_range`, the third table is for lips.

    bands : wavelengths of the channels; None for linear Rec. 709
    """
    lips = skin_look.oxygen, LIP_EPIDERMIS_THICKNESS_RATIO * skin_look.epidermis_mm
    kinds = *((oxygen, skin_look.epidermis_mm) for oxygen in oxygen_range(skin_look)), lips
    tables = [skin_colour_table(skin_look.eumelanin, *kind, bands).colours for kind in kinds]
    return np.stack(tables).astype(np.float32)


@dataclass(frozen=True, repr=False)
class PaintedMaps(Maps):
    """Skin maps that the GPU paints from a skin look, unless the user gives them.

    A field is None if its map is painted; a map in the field is used instead of the painted map.

    look : pigments and texture of the skin
    bands : wavelengths of the channels of the colour map; None for linear Rec. 709
    """

    look: SkinLook = field(default_factory=SkinLook)
    bands: Bands | None = None
    is_painted: ClassVar[bool] = True

    @property
    def has_roughness(self) -> bool:
        """Return whether there is a roughness map; always True, because a missing map is painted."""
        return True

    @cached_property
    def mean_colour(self) -> NDArray[np.float64] | None:
        """Return the mean colour (3,) of the colour map, or of the skin look if there is no map [-].

        Colours are linear Rec. 709, unless there are `bands`.
        """
        return super().mean_colour if self.colour is not None else mean_colour(self.look, self.bands)
