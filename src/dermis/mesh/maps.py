"""Maps of a mesh, in the units that the renderer works with."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from dermis.base.arrays import Bytes, Doubles, Floats
from dermis.base.summary import ShortRepr

_MEAN_TEXELS, _MOST_APART = 64, 16  # for means: fewest samples a side, largest stride


@dataclass(frozen=True, repr=False)
class Maps(ShortRepr):
    """Maps of the skin, None where there is none. Row 0 is the top; sizes may differ from map to map.

    colour : (H, W, 3) linear Rec. 709 [-]
    normal : (H, W, 2) slopes dh/du and dh/d(up) of the bumps, up being towards row 0 [-]
    height : (H, W) outwards, from an arbitrary zero [mm]
    specular : (H, W) plain grey 0..1; the renderer scales it to a mean over the skin [-]
    roughness : (H, W) plain grey 0..1 [-]
    region : (H, W) uint8 part of the face, an index into the head's own list
    """

    colour: Floats | None = None
    normal: Floats | None = None
    height: Floats | None = None
    specular: Floats | None = None
    roughness: Floats | None = None
    region: Bytes | None = None
    is_painted: ClassVar[bool] = False
    """Whether the device paints those that are None."""

    @property
    def has_roughness(self) -> bool:
        """Whether the roughness comes from a map."""
        return self.roughness is not None

    @cached_property
    def mean_colour(self) -> Doubles | None:
        """(3,) of the colour map, without the black texels of empty space [-]."""
        if self.colour is None:
            return None
        apart = int(np.clip(min(self.colour.shape[:2]) // _MEAN_TEXELS, 1, _MOST_APART))
        texels = self.colour[::apart, ::apart].reshape(-1, 3).astype(np.float64)
        painted = texels[texels.sum(axis=1) > 0.0]
        return np.asarray(painted.mean(axis=0)) if len(painted) else np.zeros(3)
