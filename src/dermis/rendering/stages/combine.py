"""The weighted sum of the blurred levels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.gpu import ComputeProgram, Device, Frame
from dermis.optics.gaussians import MOST_GAUSSIANS
from dermis.rendering.stages import STAGES
from dermis.rendering.stages.diffuse import Levels


class Combine:
    """Adds the levels up."""

    def __init__(self, device: Device) -> None:
        self._program = ComputeProgram(device, STAGES / "combine.wgsl")

    def draw(self, frame: Frame, levels: Levels, weight: NDArray[np.float64], into: Any) -> None:
        """Sum of the blurred layers, which start after the unblurred one.

        weight : (k, 3) per layer and channel
        """
        padded = np.zeros((MOST_GAUSSIANS, 4), np.float32)
        padded[: len(weight), :3] = weight
        record = self._program.record("Weights", first=1, count=len(weight), weight=padded)
        bound = {"weights": record, "levels": levels.stack, "combined": into}
        frame.compute("combine", self._program, bound, (levels.size, levels.size))
