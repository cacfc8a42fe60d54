"""Light that enters the skin, on the atlas."""

from __future__ import annotations

from typing import Any

from dermis.gpu import Device, Frame
from dermis.rendering.layout import Layout
from dermis.rendering.stages import STAGES
from dermis.rendering.stages.surface_texels import SurfaceTexels
from dermis.rendering.stages.variants import Switches, Variants, lighting_switches


class Irradiance:
    """Lights each texel of the atlas."""

    def __init__(self, device: Device) -> None:
        self._surfaces = SurfaceTexels(device)
        self._variants = Variants(device, STAGES / "irradiance.wgsl")
        self._suited = lighting_switches(device)
        self._variants.program(self._suited)

    def draw(self, frame: Frame, layout: Layout, switches: Switches, into: Any, size: int) -> None:
        """Irradiance that passes the surface, times albedo^mix, into a texture of the atlas' size.

        switches : of the lights
        """
        program = self._variants.program(switches + self._suited)
        bound = {**layout.lit, "surfaces": self._surfaces.of(layout), "entered": into}
        frame.compute("irradiance", program, bound, (size, size))
