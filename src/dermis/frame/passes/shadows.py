"""Shadow maps: one layer for each light that casts shadows, redrawn only when the light or the mesh moved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dermis.frame.geometry import HeadTextures
from dermis.frame.limits import check_shadows
from dermis.frame.passes import STAGES
from dermis.frame.passes.visibility_buffer import Layers, Nearest
from dermis.frame.projection import Views
from dermis.gpu import ComputeProgram, Device, Frame, make_texture


@dataclass
class ShadowMaps:
    """A depth layer for each light [Williams1978].

    bounds : texture of the nearest depths in ever larger squares of each layer, for lights of some size
    drawn : key of what they show
    """

    layers: Layers
    bounds: Any
    drawn: bytes = b""

    @property
    def texture(self) -> Any:
        """Depth from each light: 1 near, 0 nothing."""
        return self.layers.texture


class Shadows:
    """Draws the depth that each light sees."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._nearest = Nearest(device, triangles=False)
        self._bound = ComputeProgram(device, STAGES / "shadow_bounds.wgsl")

    def make_maps(self, layers: int, size: int) -> ShadowMaps:
        """Empty maps, `size` texels a side.

        Raises DermisError when they do not fit into memory.
        """
        check_shadows(self._device, layers, size)
        side = _squares(size)
        bounds = make_texture(self._device, (side + side // 2, side), "r32float", layers=max(2, layers))
        return ShadowMaps(self._nearest.make_layers((size, size), layers), bounds)

    def draw(
        self,
        frame: Frame,
        maps: ShadowMaps,
        views: Views,
        head: HeadTextures,
        key: bytes,
        bounded: bool = True,
    ) -> None:
        """Draw every layer, unless the maps already show just that.

        bounded : whether some light has a size, so that the bounds are read
        """
        key += b"bounded" * bounded
        if len(views.clips) and maps.drawn != key:
            self._nearest.draw(frame, "shadows", maps.layers, views, head)
            if bounded:
                self._draw_bounds(frame, maps, len(views.clips))
            maps.drawn = key

    def _draw_bounds(self, frame: Frame, maps: ShadowMaps, count: int) -> None:
        resources = {"maps": maps.texture, "maps_sampler": self._device.sampler(), "bounds": maps.bounds}
        groups = _squares(maps.layers.size[0]) // 16
        frame.dispatch("shadows", self._bound, resources, (groups, groups, count))


def _squares(size: int) -> int:
    """Squares of 4 texels along a side of the map, in whole squares of 64."""
    return 16 * -(-size // 64)
