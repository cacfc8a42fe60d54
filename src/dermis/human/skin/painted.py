"""Maps that are numbers still: what the frame paints a human's skin from."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from dermis.human.skin.colours import mean_colour
from dermis.human.skin.look import SkinLook
from dermis.mesh.maps import Maps

LEAST_SIDE, MOST_SIDE = 256, 4096
"""Sides of painted maps [texels]."""


@dataclass(frozen=True, repr=False)
class PaintedMaps(Maps):
    """Maps that the device paints by a look; those that are given replace what it paints.

    look : pigments and texture of the skin
    """

    look: SkinLook = field(default_factory=SkinLook)
    painted: ClassVar[bool] = True

    @property
    def rough(self) -> bool:
        """Whether the roughness comes from a map: it does."""
        return True

    @cached_property
    def mean_colour(self) -> NDArray[np.float64] | None:
        """(3,) of the skin of usual places [-]."""
        return super().mean_colour if self.colour is not None else mean_colour(self.look)
