"""Light that enters on the far side of thin parts and leaves here: ears, nostrils, lips, lids."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.gpu import ComputeProgram, Device, Frame
from dermis.optics.gaussians import MOST_GAUSSIANS
from dermis.rendering.stages import SHARED_SHADERS, STAGES
from dermis.rendering.stages.diffuse import Levels

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Thin:
    """Thin parts of an atlas.

    opposite : what `Opposite.find` found
    light : texture of the same size for what comes through
    """

    opposite: Any
    light: Any


class Transmission:
    """Lets the blurred levels of the far side through [dEonLuebke2007].

    A Gaussian of the straight distance is one over the far surface times exp(-d^2 / 2v). So the far side's
    own blurred levels are what comes through, whatever lights made them, and there is nothing left to blur.
    """

    def __init__(self, device: Device) -> None:
        self._program = ComputeProgram(device, STAGES / "transmission.wgsl", (SHARED_SHADERS,))

    def draw(
        self,
        frame: Frame,
        levels: Levels,
        thin: Thin,
        variance_mm2: Floats,
        weight: Floats,
    ) -> Any:
        """The light that comes through, summed over the blurred layers, which start after the unblurred one.

        variance_mm2, weight : (k,) and (k, 3) of the layers
        """
        gaussian = np.zeros((MOST_GAUSSIANS, 4), np.float32)
        gaussian[: len(weight), :3], gaussian[: len(weight), 3] = weight, np.sqrt(variance_mm2)
        record = self._program.record("Through", first=1, count=len(weight), gaussian=gaussian)
        shown = {"opposite": thin.opposite, "transmitted": thin.light}
        bound = {"through": record, "levels": levels.stack, **shown}
        frame.compute("transmission", self._program, bound, thin.light.size[:2])
        return thin.light
