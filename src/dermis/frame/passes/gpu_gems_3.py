"""The published blurs as the baseline to measure against: seven taps, halves, a blurred stretch map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.frame.atlas_textures import AtlasTextures
from dermis.frame.levels import Levels
from dermis.frame.passes import STAGES
from dermis.gpu import ComputeProgram, Device, Frame, make_texture

TEXEL = "rgba16float"
Pair = tuple[Any, Any]


class Published:
    """Spreads the light of layer 0 to the layers above it, in twelve passes for six Gaussians."""

    name = "gpu-gems-3"

    def __init__(self, device: Device) -> None:
        self._device = device
        self._made: dict[str, list[Any]] = {}

    def make_levels(self, size: int, count: int) -> Levels:
        """Space for the unblurred light and `count` blurred levels."""
        stack = make_texture(self._device, (size, size), TEXEL, layers=max(2, count + 1))
        scratch, *stretch = (make_texture(self._device, (size, size), TEXEL) for _ in range(3))
        return Levels(stack, scratch, size, TEXEL, (0,) * (count + 1), stretch=tuple(stretch))

    def draw(
        self,
        frame: Frame,
        levels: Levels,
        atlas: AtlasTextures,
        variance_mm2: NDArray[np.float64],
        edge: str = "cleared",
        clear: ArrayLike = (0.0, 0.0, 0.0),
        scale: float = 1.0,
    ) -> None:
        """Fill layer k with the light spread by variance_mm2[k - 1] (increasing).

        edge : "cleared", where empty texels show the light `clear`, or "skipped", where they are left out
        scale : what light is multiplied with in the layers
        """
        sampler = self._device.sampler(mag_filter="linear", min_filter="linear")
        along, (stretch, spare) = self._along(edge), levels.stretch
        levels.scale = scale
        source, before = atlas.resources["stretch_map"], 0.0
        for k, variance in enumerate(variance_mm2, start=1):
            record = along[0].record(
                "Spread", sigma_mm=np.sqrt(variance - before), clear=scale * np.asarray(clear)
            )
            passes = (
                (levels.layer(k - 1), source, levels.spare(), spare),
                (levels.spare(), spare, levels.layer(k), stretch),
            )
            for program, (light, wide, blurred, wider) in zip(along, passes, strict=True):
                bound = {"spread": record, "linear": sampler, "source": light, "stretch": wide}
                self._run(frame, program, bound, (blurred, wider), levels.size)
            source, before = stretch, float(variance)

    def _run(self, frame: Frame, program: Any, bound: dict[str, Any], into: Pair, side: int) -> None:
        """One pass into a texture of light and one of stretch."""
        bound = bound | {"blurred": into[0], "stretch_blurred": into[1]}
        frame.compute("diffuse", program, bound, (side, side))

    def _along(self, edge: str) -> list[Any]:
        """The passes along u and along v, made when first asked for."""
        if edge not in self._made:
            skipped = edge == "skipped"
            self._made[edge] = [self._program({"AXIS": axis, "SKIPPED": skipped}) for axis in (0, 1)]
        return self._made[edge]

    def _program(self, constants: dict[str, float]) -> Any:
        return ComputeProgram(self._device, STAGES / "gpu_gems_3.wgsl", constants=constants)
