"""Light that enters the skin, on the atlas."""

from __future__ import annotations

from typing import Any

from dermis.gpu import Device, Frame
from dermis.rendering.layout import Layout
from dermis.rendering.stages import STAGES
from dermis.rendering.stages.variants import Switches, Variants


class Irradiance:
    """Lights each texel of the atlas."""

    def __init__(self, device: Device) -> None:
        self._variants = Variants(device, STAGES / "irradiance.wgsl")
        self._variants.program()

    def draw(self, frame: Frame, layout: Layout, switches: Switches, into: Any, size: int) -> None:
        """Irradiance that passes the surface, times albedo^mix, into a texture of the atlas' size.

        switches : of the lights
        """
        program = self._variants.program(switches)
        frame.compute(
            "irradiance", program, {**layout.lit, **layout.atlas.resources, "entered": into}, (size, size)
        )
