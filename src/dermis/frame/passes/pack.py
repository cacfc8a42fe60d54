"""Packs the finished picture for readback: three bytes or three floats per pixel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.frame.passes import program
from dermis.frame.passes.post import Picture
from dermis.gpu import Device, Graph
from dermis.gpu.readback import Fetched

_ROW = 1024  # as in the shaders
_PIXELS, _WORDS = 4, 3  # read and written by one invocation that packs bytes
_CHANNELS = 3


@dataclass(frozen=True)
class Leaving:
    """A picture on its way from the device.

    size : (width, height) [pixel]
    kind : dtype of its numbers
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


def draw(graph: Graph, picture: Picture, *, linear: bool = False) -> Leaving:
    """Pack the picture and start reading it back to NumPy.

    linear : floats rather than bytes

    Raises DermisError for more than the device has in one buffer.
    """
    device, pixels = graph.device, picture.size[0] * picture.size[1]
    if linear:
        shader, count, words = program(device, "pack_linear.wgsl"), pixels, _CHANNELS * pixels
        bound = {"exposed": picture.exposed}
    else:
        count = -(-pixels // _PIXELS)
        shader, words, bound = program(device, "pack.wgsl"), _WORDS * count, {"bytes": picture.bytes}
    _check(device, 4 * words, pixels)
    packed = _packed(device, picture, words)
    graph.compute("pack", shader, bound | {"packed": packed}, (_ROW, -(-count // _ROW)))
    return Leaving(graph.fetch(packed), picture.size, np.float32 if linear else np.uint8)


def _check(device: Device, size: int, pixels: int) -> None:
    most = device.max_storage_bytes
    if size > most:
        limit = f"at most {most * pixels // size} pixels at once from {device.adapter.name}"
        refuse("size", limit, f"there are {pixels}", "Choose a smaller one")


def _packed(device: Device, picture: Picture, words: int) -> Any:
    """A buffer of words of 4 bytes, which lives as long as the picture."""
    if words not in picture.packed:
        picture.packed[words] = device.buffer(np.zeros(words, np.uint32), "STORAGE")
    return picture.packed[words]
