"""The finished picture on its way to NumPy: three bytes or three floats a pixel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.frame.passes import STAGES
from dermis.frame.passes.post import Picture
from dermis.gpu import ComputeProgram, Device, Frame
from dermis.gpu.readback import Fetched

_ROW = 1024  # as in the shaders
_PIXELS, _WORDS = 4, 3  # of one invocation that packs bytes
_CHANNELS = 3


@dataclass(frozen=True)
class Leaving:
    """A picture that is not here yet.

    size : (width, height) [pixel]
    kind : of its numbers
    """

    fetched: Fetched
    size: tuple[int, int]
    kind: type[np.uint8] | type[np.float32]

    def image(self) -> NDArray[Any]:
        """(h, w, 3) sRGB bytes or linear floats; waits for them. To be called once."""
        width, height = self.size
        count = _CHANNELS * width * height
        numbers = self.fetched.array()[: count * np.dtype(self.kind).itemsize].view(self.kind)
        return numbers.reshape(height, width, _CHANNELS)


class Pack:
    """Takes a picture off the device."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._bytes = ComputeProgram(device, STAGES / "pack.wgsl")
        self._space: Any = None

    @cached_property
    def _linear(self) -> ComputeProgram:
        """For sequences of linear pictures."""
        return ComputeProgram(self._device, STAGES / "pack_linear.wgsl")

    def draw(self, frame: Frame, picture: Picture, *, linear: bool = False) -> Leaving:
        """The picture as the passes so far leave it.

        linear : floats rather than bytes

        Raises DermisError for more than the device has in one buffer.
        """
        pixels = picture.size[0] * picture.size[1]
        if linear:
            program, count, words = self._linear, pixels, _CHANNELS * pixels
            bound = {"exposed": picture.exposed}
        else:
            count = -(-pixels // _PIXELS)
            program, words, bound = self._bytes, _WORDS * count, {"bytes": picture.bytes}
        self._check(4 * words, pixels)
        packed = self._packed(words)
        frame.compute("pack", program, bound | {"packed": packed}, (_ROW, -(-count // _ROW)))
        return Leaving(frame.fetch(packed), picture.size, np.float32 if linear else np.uint8)

    def _check(self, size: int, pixels: int) -> None:
        most = self._device.max_storage_bytes
        if size > most:
            limit = f"at most {most * pixels // size} pixels at once from {self._device.adapter.name}"
            refuse("size", limit, f"there are {pixels}", "Choose a smaller one")

    def _packed(self, words: int) -> Any:
        """Space for words of 4 bytes; pictures that follow each other share it."""
        if self._space is None or self._space.size != 4 * words:
            self._space = self._device.buffer(np.zeros(words, np.uint32), "STORAGE")
        return self._space
