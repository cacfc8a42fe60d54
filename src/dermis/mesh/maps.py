"""Texture maps of the skin, in the units of the renderer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from dermis.base.arrays import Bytes, Doubles, Floats
from dermis.base.summary import ShortRepr

# samples of means along each side, and largest distance between samples
_MEAN_SAMPLES_PER_SIDE, _MAX_SAMPLE_DISTANCE_TEXELS = 64, 16


@dataclass(frozen=True, repr=False)
class PartMaps(ShortRepr):
    """Texture maps of everything except the skin, in one common uv layout.

    colour : (H, W, 4) base colour, linear Rec. 709, and opacity; surfaces are cut out where opacity is below
        0.5 [-]
    surface : (H, W, 4) two slopes as in `Maps.normal`, perceptual roughness and metalness [-]
    emission : (H, W, 3) emitted radiance; None if no material emits light
    """

    colour: Floats
    surface: Floats
    emission: Floats | None = None


@dataclass(frozen=True, repr=False)
class Maps(ShortRepr):
    """Texture maps of the skin; a map that a head does not have is None.

    Row 0 is the top of the map; sizes may differ from map to map.

    colour : (H, W, 3) linear Rec. 709 [-]
    normal : (H, W, 2) slopes of the relief to the right and upwards (towards row 0) [-]
    height : (H, W) height of the relief, outwards from an arbitrary zero [mm]
    specular : (H, W) specular strength, 0 to 1; the renderer divides it by its mean over the skin [-]
    roughness : (H, W) roughness, 0 to 1 [-]
    region : (H, W) uint8 index of the facial region
    parts : maps of everything that is not skin
    """

    colour: Floats | None = None
    normal: Floats | None = None
    height: Floats | None = None
    specular: Floats | None = None
    roughness: Floats | None = None
    region: Bytes | None = None
    parts: PartMaps | None = None
    is_painted: ClassVar[bool] = False
    """Whether maps that are None are painted on the GPU."""

    @property
    def has_roughness(self) -> bool:
        """Return whether there is a roughness map."""
        return self.roughness is not None

    @cached_property
    def mean_colour(self) -> Doubles | None:
        """Return the mean colour (3,) of the colour map without unused (black) texels; None without a map."""
        if self.colour is None:
            return None
        stride = int(
            np.clip(min(self.colour.shape[:2]) // _MEAN_SAMPLES_PER_SIDE, 1, _MAX_SAMPLE_DISTANCE_TEXELS)
        )
        texels = self.colour[::stride, ::stride].reshape(-1, 3).astype(np.float64)
        used = texels[texels.sum(axis=1) > 0.0]
        return np.asarray(used.mean(axis=0)) if len(used) else np.zeros(3)
