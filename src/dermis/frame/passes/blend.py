"""Two layouts blended so that neither's seams are seen: the talk's several uv sets."""

from __future__ import annotations

from typing import Any

from dermis.frame.atlas_layout import Layout
from dermis.frame.passes import SHARED_SHADERS, STAGES
from dermis.frame.seams import FEATHER_MM
from dermis.gpu import ComputeProgram, Device, Frame


class Blend:
    """Takes the light near the seams of one layout from another."""

    def __init__(self, device: Device) -> None:
        constants = {"FADE_MM": FEATHER_MM}
        self._program = ComputeProgram(device, STAGES / "blend.wgsl", (SHARED_SHADERS,), constants)

    def draw(self, frame: Frame, first: Layout, second: Layout, into: Any) -> None:
        """The first layout's light, near its edges the second's, in a texture of the first's atlas."""
        bound = {
            **second.lit,  # whose triangle table tells the second layout's places
            **first.atlas.resources,
            "first": first.scattered,
            "second": second.scattered,
            "blended": into,
        }
        frame.compute("blend", self._program, bound, into.size[:2])
