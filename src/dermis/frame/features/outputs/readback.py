"""Readback of the picture, packed as three or four bytes or floats per pixel, and of outputs with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.features.outputs.landmarks import LandmarkPositions
from dermis.frame.features.outputs.planes import PlaneArray
from dermis.frame.features.outputs.resources import Resources
from dermis.frame.features.post.picture import Picture, encoding_of
from dermis.frame.programs import program
from dermis.gpu import Buffer, Device, Graph, MutableBindings
from dermis.gpu.readback import BufferReadback
from dermis.scene.settings import Settings

PictureArray = NDArray[Any]  # callers choose the dtype
"""(h, w, 3 or 4): sRGB bytes, or linear floats."""
_ROW = 1024  # as in the shaders
_WORD = 4  # bytes
_PIXELS, _WORDS = 4, 3  # read and written by one invocation that packs bytes


@dataclass(frozen=True)
class Readback:
    """A picture on its way from the device.

    size : (width, height) [pixel]
    kind : dtype of its numbers
    channels : 3, or 4 with alpha
    words : that the picture takes, before the outputs
    outputs : that come with it, None for none
    """

    fetched: BufferReadback
    size: tuple[int, int]
    kind: type[np.uint8] | type[np.float32]
    channels: int
    words: int
    outputs: Resources | None = None

    def image(self) -> PictureArray:
        """(h, w, 3 or 4) sRGB bytes or linear floats; waits for them. To be called once."""
        return self._image(self.fetched.array())

    def all(self) -> tuple[PictureArray, dict[str, PlaneArray], LandmarkPositions]:
        """The same, outputs by name and `LandmarkBuffers.found`; in its place, to be called once."""
        raw, start, found = self.fetched.array(), _WORD * self.words, dict[str, PlaneArray]()
        if self.outputs is None:
            return self._image(raw), {}, {}
        for planes in self.outputs.planes:
            end = start + planes.buffer.size
            found |= planes.arrays(raw[start:end])
            start = end
        places = self.outputs.landmarks
        landmarks = places.found(raw[start : start + places.buffer.size]) if places else {}
        return self._image(raw), {name: found[name] for name in self.outputs.names}, landmarks

    def _image(self, raw: NDArray[np.uint8]) -> PictureArray:
        width, height = self.size
        count = self.channels * width * height
        numbers = raw[: count * np.dtype(self.kind).itemsize].view(self.kind)
        return numbers.reshape(height, width, self.channels)


def start_readback(
    graph: Graph,
    picture: Picture,
    *,
    linear: bool = False,
    alpha: Settings | None = None,
    outputs: Resources | None = None,
) -> Readback:
    """Pack the picture and start reading it back to NumPy.

    linear : floats rather than bytes
    alpha : settings of the picture where the head's coverage is wanted too: light times coverage as floats,
        colours that are to be multiplied by it as bytes
    outputs : what comes with it

    Raises DermisError for more than the device has in one buffer.
    """
    device, pixels, bound = graph.device, picture.size[0] * picture.size[1], MutableBindings()
    channels = 4 if alpha else 3
    if linear:
        shader = program(device, "outputs/pack_linear.wgsl", (("CHANNELS", channels),))
        count, words, bound["exposed"] = pixels, channels * pixels, picture.exposed
    elif alpha:
        shader, count, words = program(device, "outputs/pack_straight.wgsl"), pixels, pixels
        bound["exposed"] = picture.exposed
        bound["settings"] = shader.record("Straight", **encoding_of(alpha))
    else:
        count = -(-pixels // _PIXELS)
        shader, words, bound["bytes"] = program(device, "outputs/pack.wgsl"), _WORDS * count, picture.bytes
    _check(device, _WORD * words, pixels)
    packed = _packed(device, picture, words)
    buffers = [packed, *(outputs.buffers if outputs else ())]
    _check_sum(device, buffers, pixels)
    graph.compute("pack", shader, bound | {"packed": packed}, (_ROW, -(-count // _ROW)))
    kind = np.float32 if linear else np.uint8
    return Readback(graph.read_back(*buffers), picture.size, kind, channels, words, outputs)


def _check(device: Device, size: int, pixels: int) -> None:
    most = device.max_storage_bytes
    if size > most:
        limit = f"at most {most * pixels // size} pixels at once from {device.adapter.name}"
        refuse("size", limit, f"there are {pixels}", "Choose a smaller one")


def _check_sum(device: Device, buffers: list[Buffer], pixels: int) -> None:
    size, most = sum(buffer.size for buffer in buffers), device.max_buffer_bytes
    if size > most:
        limit = f"outputs of at most {most * pixels // size} pixels at once from {device.adapter.name}"
        refuse("size", limit, f"there are {pixels}", "Ask for fewer outputs, or a smaller size")


def _packed(device: Device, picture: Picture, words: int) -> Buffer:
    """A buffer of words of 4 bytes, which lives as long as the picture."""
    if words not in picture.packed:
        picture.packed[words] = device.buffer(np.zeros(words, np.uint32), "STORAGE")
    return picture.packed[words]
