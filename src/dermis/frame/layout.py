"""One atlas layout of a frame: the lit atlas, and what the features keep for it."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features.atlas.lit import LitAtlas
from dermis.frame.features.interreflection.interreflection import Interreflection
from dermis.frame.features.occlusion.moving import MovingOcclusion
from dermis.frame.features.translucency.resources import Translucency


@dataclass(frozen=True, eq=False)
class AtlasLayout(LitAtlas):
    """An atlas of the head that light is spread on.

    translucency : light through thin parts, None without any
    occlusion : what updates the map of occlusion as the shape moves, None where it does not move
    interreflection : light from skin to skin, None for none
    """

    translucency: Translucency | None = None
    occlusion: MovingOcclusion | None = None
    interreflection: Interreflection | None = None
