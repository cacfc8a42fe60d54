"""Light that enters the skin, on the atlas."""

from __future__ import annotations

from typing import Any

from dermis.gpu import Device, Frame
from dermis.rendering.layout import Layout
from dermis.rendering.levels import FLOATS
from dermis.rendering.stages import STAGES, STORE_SHADERS
from dermis.rendering.stages.surface_texels import SurfaceTexels
from dermis.rendering.stages.variants import Switches, Variants, lighting_switches


class Irradiance:
    """Lights each texel of the atlas.

    texel : format of the levels that the light is usually for
    """

    def __init__(self, device: Device, texel: str) -> None:
        self._device, self._variants = device, dict[str, Variants]()
        self._surfaces = SurfaceTexels(device)
        self._suited = lighting_switches(device)
        self._program((), texel)

    def draw(
        self,
        frame: Frame,
        layout: Layout,
        switches: Switches,
        into: Any,
        side: int,
        texel: str = FLOATS,
        scale: float = 1.0,
    ) -> None:
        """Irradiance that passes the surface, times albedo^mix, into a texture of the atlas' size.

        switches : of the lights
        texel : the texture's format
        scale : what light is multiplied with there
        """
        program = self._program(switches, texel)
        bound = {
            **layout.lit,
            "surfaces": self._surfaces.of(layout),
            "entering": program.record("Entering", scale=scale),
        }
        self._run(frame, program, bound, into, side)

    def _program(self, switches: Switches, texel: str) -> Any:
        """What stores light in a format, made when first asked for."""
        if texel not in self._variants:
            path, stores = STAGES / "irradiance.wgsl", (STORE_SHADERS[texel],)
            self._variants[texel] = Variants(self._device, path, stores)
        return self._variants[texel].program(switches + self._suited)

    def _run(self, frame: Frame, program: Any, bound: dict[str, Any], into: Any, side: int) -> None:
        frame.compute("irradiance", program, bound | {"stored": into}, (side, side))
