"""The finished picture on its way to NumPy: three bytes a pixel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.gpu import ComputeProgram, Device, Frame
from dermis.gpu.readback import Fetched
from dermis.rendering.stages import STAGES
from dermis.rendering.stages.post import Picture

_ROW = 1024  # as in pack.wgsl
_PIXELS, _WORDS = 4, 3  # of one invocation


@dataclass(frozen=True)
class Leaving:
    """Bytes that are not here yet.

    size : (width, height) [pixel]
    """

    fetched: Fetched
    size: tuple[int, int]

    def image(self) -> NDArray[np.uint8]:
        """(h, w, 3) sRGB bytes; waits for them. To be called once."""
        width, height = self.size
        return self.fetched.array()[: 3 * width * height].reshape(height, width, 3)


class Pack:
    """Takes a picture's bytes off the device."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._program = ComputeProgram(device, STAGES / "pack.wgsl")
        self._space: Any = None

    def draw(self, frame: Frame, picture: Picture) -> Leaving:
        """The picture as the passes so far leave it."""
        width, height = picture.size
        count = -(-width * height // _PIXELS)
        bound = {"bytes": picture.bytes, "packed": self._packed(count)}
        frame.compute("pack", self._program, bound, (_ROW, -(-count // _ROW)))
        return Leaving(frame.fetch(bound["packed"]), picture.size)

    def _packed(self, count: int) -> Any:
        """Space for four times `count` pixels; pictures that follow each other share it."""
        if self._space is None or self._space.size != 4 * _WORDS * count:
            self._space = self._device.buffer(np.zeros(_WORDS * count, np.uint32), "STORAGE")
        return self._space
