"""Which triangle each sample sees: the only work of the rasteriser on the image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dermis.gpu import Device, Frame, RasterProgram, make_texture
from dermis.rendering.maps import HeadTextures
from dermis.rendering.projection import Matrix
from dermis.rendering.stages import SHARED_SHADERS, STAGES


@dataclass(frozen=True)
class Seen:
    """A layer of triangle indices for each sample of a pixel."""

    texture: Any
    views: list[Any]
    depth: Any


class Visibility:
    """Draws the triangle index of each sample; a visibility buffer [Burns2013]."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._program = RasterProgram(
            device, STAGES / "visibility.wgsl", (SHARED_SHADERS,), target="r32uint", depth_compare="less"
        )

    def make_seen(self, size: tuple[int, int], samples: int) -> Seen:
        """Space for `samples` layers."""
        texture = make_texture(self._device, size, "r32uint", layers=max(2, samples), use="raster")
        views = [
            texture.create_view(dimension="2d", base_array_layer=k, array_layer_count=1)
            for k in range(samples)
        ]
        return Seen(
            texture, views, make_texture(self._device, size, "depth32float", use="raster").create_view()
        )

    def draw(self, frame: Frame, seen: Seen, clips: list[Matrix], head: HeadTextures) -> None:
        """One layer for each matrix, which differ by the sample's place in the pixel."""
        for view, clip in zip(seen.views, clips, strict=True):
            bound = {
                **head.resources,
                "view": self._program.record("View", clip=np.asarray(clip.T, np.float32)),
            }
            frame.draw(
                "visibility", self._program, bound, 3 * head.triangles, depth=seen.depth, far=1.0, target=view
            )
