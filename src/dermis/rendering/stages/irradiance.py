"""Light that enters the skin, on the atlas."""

from __future__ import annotations

from typing import Any

from dermis.gpu import ComputeProgram, Device, Frame
from dermis.gpu.program import Resources
from dermis.rendering.stages import SHARED_SHADERS, STAGES


class Irradiance:
    """Lights each texel of the atlas."""

    def __init__(self, device: Device) -> None:
        self.program = ComputeProgram(device, STAGES / "irradiance.wgsl", (SHARED_SHADERS,))

    def draw(self, frame: Frame, lit: Resources, atlas: Resources, into: Any, size: int) -> None:
        """Irradiance that passes the surface, times albedo^mix, into a texture of the atlas' size."""
        frame.compute("irradiance", self.program, {**lit, **atlas, "entered": into}, (size, size))
