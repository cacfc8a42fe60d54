"""Which triangle each sample of the image sees: a visibility buffer [Burns2013]."""

from __future__ import annotations

from dermis.frame.geometry import HeadTextures
from dermis.frame.passes.visibility_buffer import Layers, Nearest
from dermis.frame.projection import Views
from dermis.gpu import Device, Frame


class Visibility:
    """Finds the triangle of each sample; all shading happens later, in compute."""

    def __init__(self, device: Device) -> None:
        self._nearest = Nearest(device, triangles=True)

    def make_seen(self, size: tuple[int, int], samples: int) -> Layers:
        """Space for a layer of triangle indices for each sample of a pixel."""
        return self._nearest.make_layers(size, samples)

    def draw(self, frame: Frame, seen: Layers, views: Views, head: HeadTextures) -> None:
        """One layer for each sample of the camera."""
        self._nearest.draw(frame, "visibility", seen, views, head)
