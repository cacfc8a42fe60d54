"""The image from all that was computed before it."""

from __future__ import annotations

from typing import Any

from dermis.frame.passes import STAGES
from dermis.frame.passes.variants import Constants, Variants, lighting_constants
from dermis.frame.passes.visibility_buffer import Layers
from dermis.gpu import ComputeProgram, Device, Frame, make_texture
from dermis.gpu.program import Resources
from dermis.scene.settings import Settings

_STRIP = 16  # pixels of an invocation on software adapters, see shade.wgsl
_TECHNIQUES: dict[str, Constants] = {
    "screen-space": (("SPLIT", 1),),
    "pre-integrated": (("PRE_INTEGRATED", 1),),
}


def technique_constants(settings: Settings) -> Constants:
    """Those of the techniques that this pass has a part in."""
    return _TECHNIQUES.get(settings.technique, ())


class Shade:
    """Shades every sample of every pixel and averages them."""

    def __init__(self, device: Device) -> None:
        self._strip = _STRIP if device.adapter.kind == "CPU" else 1
        self._suited = lighting_constants(device)
        self._variants = Variants(device, STAGES / "shade.wgsl")
        self.program = self._program(())
        self._nothing = make_texture(device, (1, 1), "rgba32float", layers=2)

    def draw(
        self,
        frame: Frame,
        lit: Resources,
        view: Any,
        constants: Constants,
        seen: Layers,
        scattered: Any,
        into: Any,
        size: tuple[int, int],
        apart: Any = None,
    ) -> None:
        """Radiance and coverage into a texture of the image's size.

        view : record of the shader's struct Shade
        constants : of the lights, the surface and the technique
        scattered : light below the skin by place on the atlas, or the tables of pre-integrated skin
        apart : layers for the light below the skin and how it leaves, which the radiance is then without
        """
        bound = {**lit, "shade": view, "seen": seen.texture, "scattered": scattered, "image": into}
        bound["apart"] = apart or self._nothing
        strips = size[0], -(-size[1] // self._strip)
        frame.compute("shade", self._program(constants), bound, strips)

    def _program(self, constants: Constants) -> ComputeProgram:
        """The pipeline for these constants on this device."""
        return self._variants.program((*constants, *self._suited, ("STRIP", self._strip)))
