"""Light that enters the skin, on the atlas."""

from __future__ import annotations

from typing import Any

from dermis.frame.atlas_layout import Layout
from dermis.frame.levels import FLOATS
from dermis.frame.passes import STAGES, STORE_SHADERS
from dermis.frame.passes.surface_texels import SurfaceTexels
from dermis.frame.passes.variants import Constants, Variants, lighting_constants
from dermis.gpu import Device, Frame


class Irradiance:
    """Lights each texel of the atlas.

    texel : format of the levels that the light is usually for
    """

    def __init__(self, device: Device, texel: str) -> None:
        self._device, self._variants = device, dict[str, Variants]()
        self._surfaces = SurfaceTexels(device)
        self._suited = lighting_constants(device)
        self._program((), texel)

    def draw(
        self,
        frame: Frame,
        layout: Layout,
        constants: Constants,
        into: Any,
        side: int,
        texel: str = FLOATS,
        scale: float = 1.0,
    ) -> None:
        """Irradiance that passes the surface, times albedo^mix, into a texture of the atlas' size.

        constants : of the lights
        texel : the texture's format
        scale : what light is multiplied with there
        """
        program = self._program(constants, texel)
        bound = {
            **layout.lit,
            "surfaces": self._surfaces.of(layout),
            "entering": program.record("Entering", scale=scale),
        }
        self._run(frame, program, bound, into, side)

    def _program(self, constants: Constants, texel: str) -> Any:
        """What stores light in a format, made when first asked for."""
        if texel not in self._variants:
            path, stores = STAGES / "irradiance.wgsl", (STORE_SHADERS[texel],)
            self._variants[texel] = Variants(self._device, path, stores)
        return self._variants[texel].program(constants + self._suited)

    def _run(self, frame: Frame, program: Any, bound: dict[str, Any], into: Any, side: int) -> None:
        frame.compute("irradiance", program, bound | {"stored": into}, (side, side))
