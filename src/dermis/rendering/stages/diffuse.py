"""The hierarchy of Gaussian blurs: each level from the one before, first along u, then along v."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.gpu import ComputeProgram, Device, Frame, make_texture
from dermis.gpu.program import Resources
from dermis.gpu.textures import texture_from
from dermis.rendering.kernels import ROWS_PER_UNIT, TRUNCATION, WIDEST, kernel_table
from dermis.rendering.stages import STAGES


@dataclass(frozen=True)
class Levels:
    """The blurred irradiance, layer 0 not blurred, and the space between two passes."""

    stack: Any
    views: list[Any]
    scratch: Any
    size: int


class Diffuse:
    """Spreads the light of layer 0 to the layers above it."""

    def __init__(self, device: Device) -> None:
        self._device = device
        path = STAGES / "diffuse.wgsl"
        table = {"ROWS_PER_UNIT": ROWS_PER_UNIT, "WIDEST": WIDEST, "TRUNCATION": TRUNCATION}
        self._along = [ComputeProgram(device, path, constants={"AXIS": axis, **table}) for axis in (0, 1)]
        self._kernels = texture_from(device, kernel_table(), "r32float")

    def make_levels(self, size: int, count: int) -> Levels:
        """Space for the unblurred light and `count` blurred levels."""
        stack = make_texture(self._device, (size, size), "rgba32float", layers=max(2, count + 1))
        views = [
            stack.create_view(dimension="2d", base_array_layer=k, array_layer_count=1)
            for k in range(count + 1)
        ]
        return Levels(stack, views, make_texture(self._device, (size, size), "rgba32float"), size)

    def draw(self, frame: Frame, levels: Levels, atlas: Resources, variance_mm2: NDArray[np.float64]) -> None:
        """Fill layer k with the light spread by variance_mm2[k - 1] (increasing)."""
        before = 0.0
        for k, variance in enumerate(variance_mm2, start=1):
            record = self._along[0].record("Spread", variance_mm2=variance - before, before_mm2=before)
            passes = ((levels.views[k - 1], levels.scratch), (levels.scratch, levels.views[k]))
            for program, (source, blurred) in zip(self._along, passes, strict=True):
                bound = {
                    **atlas,
                    "spread": record,
                    "source": source,
                    "kernel_table": self._kernels,
                    "blurred": blurred,
                }
                frame.compute("diffuse", program, bound, (levels.size, levels.size))
            before = float(variance)
