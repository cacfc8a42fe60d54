"""The gutters of an atlas: texels beyond a chart's edge take the light of where the surface goes on."""

from __future__ import annotations

from typing import Any

from dermis.frame.atlas_textures import AtlasTextures
from dermis.frame.passes import SOURCE_SHADERS, STAGES, STORE_SHADERS, TILE
from dermis.gpu import ComputeProgram, Device, Frame

_ROW = 1024  # as in gutter.wgsl
_BYTES = 16  # of a texel of the gutter in its list


class Stitch:
    """Carries light across the seams, in textures of a format."""

    def __init__(self, device: Device, texel: str) -> None:
        self._gather = ComputeProgram(device, STAGES / "stitch_gather.wgsl", (SOURCE_SHADERS[texel],))
        self._place = ComputeProgram(device, STAGES / "stitch_place.wgsl", (STORE_SHADERS[texel],))
        self._linear = device.sampler(mag_filter="linear", min_filter="linear")

    def draw(self, frame: Frame, stage: str, atlas: AtlasTextures, light: Any) -> None:
        """Fill the gutter of `light`; no texture can be read and written at once, so by way of a list."""
        if atlas.gutter is None:
            return
        size = (_ROW, -(-atlas.gutter.size // (_BYTES * _ROW)))
        lists = {"gutter": atlas.gutter, "gathered": atlas.gathered}
        frame.compute(stage, self._gather, {**lists, "source": light, "linear": self._linear}, size, TILE)
        frame.compute(stage, self._place, {**lists, "stored": light}, size, TILE)
