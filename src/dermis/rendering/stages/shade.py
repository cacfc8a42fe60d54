"""The image from all that was computed before it."""

from __future__ import annotations

from typing import Any

from dermis.gpu import Device, Frame
from dermis.gpu.program import Resources
from dermis.rendering.stages import STAGES
from dermis.rendering.stages.nearest import Layers
from dermis.rendering.stages.variants import Switches, Variants


class Shade:
    """Shades every sample of every pixel and averages them."""

    def __init__(self, device: Device) -> None:
        self._variants = Variants(device, STAGES / "shade.wgsl")
        self.program = self._variants.program()

    def draw(
        self,
        frame: Frame,
        lit: Resources,
        view: Any,
        switches: Switches,
        seen: Layers,
        scattered: Any,
        into: Any,
        size: tuple[int, int],
    ) -> None:
        """Radiance and coverage into a texture of the image's size.

        view : record of the shader's struct Shade
        switches : of the lights and the surface
        """
        bound = {**lit, "shade": view, "seen": seen.texture, "scattered": scattered, "image": into}
        frame.compute("shade", self._variants.program(switches), bound, size)
