"""The weighted sum of the blurred levels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.gpu import ComputeProgram, Device, Frame, make_texture
from dermis.optics.gaussians import MOST_GAUSSIANS
from dermis.rendering.stages import STAGES
from dermis.rendering.stages.diffuse import Levels


class Combine:
    """Adds the levels up."""

    def __init__(self, device: Device) -> None:
        path = STAGES / "combine.wgsl"
        self._programs = [ComputeProgram(device, path, constants={"TRANSMITTED": t}) for t in (0, 1)]
        self._nothing = make_texture(device, (1, 1), "rgba32float", use="map")

    def draw(
        self, frame: Frame, levels: Levels, weight: NDArray[np.float64], into: Any, transmitted: Any = None
    ) -> None:
        """Sum of the blurred layers, which start after the unblurred one.

        weight : (k, 3) per layer and channel
        transmitted : texture of what comes through thin parts, None without any
        """
        padded = np.zeros((MOST_GAUSSIANS, 4), np.float32)
        padded[: len(weight), :3] = weight
        program = self._programs[transmitted is not None]
        record = program.record("Weights", first=1, count=len(weight), weight=padded)
        through = self._nothing if transmitted is None else transmitted
        bound = {"weights": record, "levels": levels.stack, "transmitted": through, "combined": into}
        frame.compute("combine", program, bound, (levels.size, levels.size))
