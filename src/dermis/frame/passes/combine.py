"""The weighted sum of the blurred levels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.frame.levels import FLOATS, Levels
from dermis.frame.passes import SOURCE_SHADERS, STAGES, STORE_SHADERS, TILE
from dermis.gpu import ComputeProgram, Device, Frame, make_texture
from dermis.optics.gaussians import MOST_GAUSSIANS


class Combine:
    """Adds the levels up, from the coarsest resolution to the finest."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._programs: dict[tuple[str, int, int, int], ComputeProgram] = {}
        self._nothing = make_texture(device, (1, 1), "rgba32float", use="map")
        self._linear = device.sampler(mag_filter="linear", min_filter="linear")

    def make_sum(self, side: int) -> Any:
        """Space for the sum."""
        return make_texture(self._device, (side, side), FLOATS)

    def draw(
        self, frame: Frame, levels: Levels, weight: NDArray[np.float64], into: Any, transmitted: Any = None
    ) -> None:
        """Sum of the blurred layers, which start after the unblurred one.

        weight : (k, 3) per layer and channel
        transmitted : texture of what comes through thin parts, None without any
        """
        blurred = levels.halvings[1 : len(weight) + 1]
        coarsest = max(blurred)
        for mip in range(coarsest, -1, -1):
            through = transmitted if mip == _finest_for(transmitted, levels.size, coarsest) else None
            program = self._program(levels.texel, mip > 0, mip < coarsest, through is not None)
            first, count = blurred.index(mip), blurred.count(mip)
            padded = np.zeros((MOST_GAUSSIANS, 4), np.float32)
            padded[:count, :3] = weight[first : first + count]
            padded[0, 3] = 1.0
            layers = {"first": 1 + first, "count": count, "mip": mip, "weight": padded}
            scales = (
                {"scale": 1.0, "through": levels.scale}
                if mip
                else {"scale": 1.0 / levels.scale, "through": 1.0}
            )
            bound = {
                "weights": program.record("Weights", **layers, **scales),
                "levels": levels.stack,
                "source": levels.spare(mip + 1) if mip < coarsest else levels.layer(0),
                "transmitted": self._nothing if through is None else through,
                "linear": self._linear,
                "stored": levels.spare(mip) if mip else into,
            }
            frame.compute("combine", program, bound, (levels.size >> mip,) * 2, TILE)

    def _program(self, texel: str, between: bool, coarser: bool, transmitted: bool) -> ComputeProgram:
        """The pass into the space between, or into the sum of 32-bit floats; made when first asked for."""
        key = (texel, between, coarser, transmitted)
        if key not in self._programs:
            shaders = SOURCE_SHADERS[texel], STORE_SHADERS[texel if between else FLOATS]
            chosen = {"COARSER": coarser, "TRANSMITTED": transmitted}
            self._programs[key] = ComputeProgram(self._device, STAGES / "combine.wgsl", shaders, chosen)
        return self._programs[key]


def _finest_for(transmitted: Any, size: int, coarsest: int) -> int:
    """The resolution at which what comes through is added: half the finest one, if it has no finer detail."""
    return int(transmitted is not None and coarsest > 0 and 2 * transmitted.size[0] <= size)
