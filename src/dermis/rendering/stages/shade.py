"""The image from all that was computed before it."""

from __future__ import annotations

from typing import Any

from dermis.gpu import ComputeProgram, Device, Frame
from dermis.gpu.program import Resources
from dermis.rendering.stages import SHARED_SHADERS, STAGES
from dermis.rendering.stages.nearest import Layers


class Shade:
    """Shades every sample of every pixel and averages them."""

    def __init__(self, device: Device) -> None:
        self.program = ComputeProgram(device, STAGES / "shade.wgsl", (SHARED_SHADERS,))

    def draw(
        self,
        frame: Frame,
        lit: Resources,
        view: Any,
        seen: Layers,
        scattered: Any,
        into: Any,
        size: tuple[int, int],
    ) -> None:
        """Radiance and coverage into a texture of the image's size.

        view : record of the shader's struct Shade
        """
        bound = {**lit, "shade": view, "seen": seen.texture, "scattered": scattered, "image": into}
        frame.compute("shade", self.program, bound, size)
