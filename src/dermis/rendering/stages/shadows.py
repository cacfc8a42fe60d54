"""Shadow maps: one layer for each light that casts shadows, redrawn only when the light or the mesh moved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dermis.gpu import Device, Frame
from dermis.rendering.geometry import HeadTextures
from dermis.rendering.limits import check_shadows
from dermis.rendering.projection import Matrix
from dermis.rendering.stages.nearest import Layers, Nearest


@dataclass
class ShadowMaps:
    """A depth layer for each light [Williams1978], and the key of what they show."""

    layers: Layers
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

    def make_maps(self, layers: int, size: int) -> ShadowMaps:
        """Empty maps, `size` texels a side.

        Raises DermisError when they do not fit into memory.
        """
        check_shadows(self._device, layers, size)
        return ShadowMaps(self._nearest.make_layers((size, size), layers))

    def draw(
        self, frame: Frame, maps: ShadowMaps, clips: list[Matrix], head: HeadTextures, key: bytes
    ) -> None:
        """Draw every layer, unless the maps already show just that."""
        if clips and maps.drawn != key:
            self._nearest.draw(frame, "shadows", maps.layers, clips, head)
            maps.drawn = key
