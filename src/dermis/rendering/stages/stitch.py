"""The aprons of an atlas: texels beyond a chart's edge take the light of where the surface goes on."""

from __future__ import annotations

from typing import Any

from dermis.gpu import ComputeProgram, Device, Frame
from dermis.rendering.atlas_textures import AtlasTextures
from dermis.rendering.stages import STAGES

_ROW = 1024  # as in stitch.wgsl
_BYTES = 16  # of a texel of the apron in its list


class Stitch:
    """Carries light across the seams."""

    def __init__(self, device: Device) -> None:
        path = STAGES / "stitch.wgsl"
        self._gather, self._place = (ComputeProgram(device, path, constants={"PLACE": p}) for p in (0, 1))

    def draw(self, frame: Frame, stage: str, atlas: AtlasTextures, light: Any, spare: Any) -> None:
        """Fill the apron of `light`; no texture can be read and written at once, so by way of a list.

        spare : a texture of the same kind, left as it is
        """
        if atlas.apron is None:
            return
        size = (_ROW, -(-atlas.apron.size // (_BYTES * _ROW)))
        lists = {"apron": atlas.apron, "gathered": atlas.gathered}
        frame.compute(stage, self._gather, {**lists, "light": light, "stitched": spare}, size)
        frame.compute(stage, self._place, {**lists, "light": spare, "stitched": light}, size)
