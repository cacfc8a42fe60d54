"""Shadow maps: one layer for each light that casts shadows, redrawn only when the light or the mesh moved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dermis.gpu import Device, Frame, RasterProgram, make_texture
from dermis.rendering.maps import HeadTextures
from dermis.rendering.projection import Matrix
from dermis.rendering.stages import SHARED_SHADERS, STAGES


@dataclass
class ShadowMaps:
    """A depth layer for each matrix, and the key of what they show."""

    texture: Any
    depth_views: list[Any]
    drawn: bytes = b""


class Shadows:
    """Draws the depth that each light sees."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._program = RasterProgram(
            device, STAGES / "shadows.wgsl", (SHARED_SHADERS,), target=None, depth_compare="less"
        )

    def make_maps(self, layers: int, size: int) -> ShadowMaps:
        """Empty maps; an array texture needs two layers even for one light."""
        texture = make_texture(
            self._device, (size, size), "depth32float", layers=max(2, layers), use="raster"
        )
        views = [
            texture.create_view(dimension="2d", base_array_layer=k, array_layer_count=1)
            for k in range(layers)
        ]
        return ShadowMaps(texture, views)

    def draw(
        self, frame: Frame, maps: ShadowMaps, clips: list[Matrix], head: HeadTextures, key: bytes
    ) -> None:
        """Draw every layer, unless the maps already show just that."""
        if maps.drawn == key:
            return
        for view, clip in zip(maps.depth_views, clips, strict=True):
            record = self._program.record("View", clip=np.asarray(clip.T, np.float32))
            resources = {**head.resources, "view": record}
            frame.draw("shadows", self._program, resources, 3 * head.triangles, depth=view, far=1.0)
        maps.drawn = key
