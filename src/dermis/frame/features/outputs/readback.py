"""Readback of the picture, packed to three or four bytes or floats per pixel, and of the other outputs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.features.outputs.landmarks import LandmarkPositions
from dermis.frame.features.outputs.output_images import OutputArray
from dermis.frame.features.outputs.resources import Resources
from dermis.frame.features.post.picture import Picture, encoding_members
from dermis.frame.programs import program
from dermis.gpu import Buffer, Device, Graph, MutableBindings
from dermis.gpu.readback import BufferReadback
from dermis.scene.settings import Settings

PictureArray = NDArray[Any]  # callers choose the dtype
"""(h, w, 3) or (h, w, 4) array of sRGB bytes or linear floats."""
_PACKING_INVOCATIONS_PER_ROW = 1024  # as in the shaders
_WORD_BYTES = 4  # size of a word [bytes]
_PIXELS_PER_INVOCATION, _WORDS_PER_INVOCATION = 4, 3  # read and written by pack.wgsl


@dataclass(frozen=True)
class Readback:
    """Readback in progress of a picture and its outputs.

    fetched : readback of the buffers
    size : (width, height) [pixel]
    kind : dtype of the picture
    channels : number of channels of the picture: 3, or 4 with alpha
    words : number of 4-byte words of the packed picture; in the downloaded bytes, the outputs follow the
        picture
    outputs : resources of the outputs that are read back with the picture, None for the picture alone
    """

    fetched: BufferReadback
    size: tuple[int, int]
    kind: type[np.uint8] | type[np.float32]
    channels: int
    words: int
    outputs: Resources | None = None

    def image(self) -> PictureArray:
        """Wait for the picture and return it as an (h, w, channels) array.

        This method can be called only once."""
        return self._decode_picture(self.fetched.array())

    def image_and_outputs(self) -> tuple[PictureArray, dict[str, OutputArray], LandmarkPositions]:
        """Wait for the readback; return the picture, and dictionaries of the outputs and of the landmarks.

        The keys are the names of the outputs and of the landmark sets. Call either this method or `image`,
        and only once.
        """
        raw, start, arrays = self.fetched.array(), _WORD_BYTES * self.words, dict[str, OutputArray]()
        if self.outputs is None:
            return self._decode_picture(raw), {}, {}
        for images in self.outputs.images:
            end = start + images.buffer.size
            arrays |= images.decode_outputs(raw[start:end])
            start = end
        buffers = self.outputs.landmarks
        landmarks = buffers.decode_positions(raw[start : start + buffers.results.size]) if buffers else {}
        return self._decode_picture(raw), {name: arrays[name] for name in self.outputs.names}, landmarks

    def _decode_picture(self, picture_bytes: NDArray[np.uint8]) -> PictureArray:
        width, height = self.size
        count = self.channels * width * height
        values = picture_bytes[: count * np.dtype(self.kind).itemsize].view(self.kind)
        return values.reshape(height, width, self.channels)


def start_readback(
    graph: Graph,
    picture: Picture,
    *,
    as_linear: bool = False,
    alpha_settings: Settings | None = None,
    outputs: Resources | None = None,
) -> Readback:
    """Pack the picture and its outputs, and start their readback.

    as_linear : whether to read linear floats instead of sRGB bytes
    alpha_settings : settings of the picture if its coverage is to be read as alpha, else None. Floats are
        multiplied by alpha, bytes are not
    outputs : resources of the outputs to read back with the picture, None for the picture alone

    Raises DermisError if the data do not fit in one buffer of the device.
    """
    device, pixels, bindings = graph.device, picture.size[0] * picture.size[1], MutableBindings()
    channels = 4 if alpha_settings else 3
    if as_linear:
        shader = program(device, "outputs/pack_linear.wgsl", (("CHANNELS", channels),))
        count, words, bindings["exposed"] = pixels, channels * pixels, picture.exposed
    elif alpha_settings:
        shader, count, words = program(device, "outputs/pack_straight.wgsl"), pixels, pixels
        bindings["exposed"] = picture.exposed
        bindings["settings"] = shader.make_record("Straight", **encoding_members(alpha_settings))
    else:
        count = -(-pixels // _PIXELS_PER_INVOCATION)
        shader, words = program(device, "outputs/pack.wgsl"), _WORDS_PER_INVOCATION * count
        bindings["bytes"] = picture.bytes
    _check_readback_size(device, _WORD_BYTES * words, device.max_storage_bytes, pixels)
    packed = _packed_buffer(device, picture, words)
    buffers = [packed, *(outputs.buffers if outputs else ())]
    _check_readback_size(
        device, sum(buffer.size for buffer in buffers), device.max_buffer_bytes, pixels, "outputs of "
    )
    grid = _PACKING_INVOCATIONS_PER_ROW, -(-count // _PACKING_INVOCATIONS_PER_ROW)
    graph.compute("pack", shader, bindings | {"packed": packed}, grid)
    kind = np.float32 if as_linear else np.uint8
    return Readback(graph.read_back(*buffers), picture.size, kind, channels, words, outputs)


def _check_readback_size(
    device: Device, needed_bytes: int, max_bytes: int, pixel_count: int, contents_name: str = ""
) -> None:
    if needed_bytes > max_bytes:
        max_pixels = max_bytes * pixel_count // needed_bytes
        expected = f"{contents_name}at most {max_pixels} pixels at once from {device.adapter.name}"
        advice = "Ask for fewer outputs, or a smaller size" if contents_name else "Choose a smaller one"
        refuse("size", expected, f"there are {pixel_count}", advice)


def _packed_buffer(device: Device, picture: Picture, word_count: int) -> Buffer:
    """Return the buffer for the packed picture, which is kept in `Picture.packed` for later readbacks.

    word_count : number of 4-byte words of the packed picture
    """
    if word_count not in picture.packed:
        picture.packed[word_count] = device.buffer(np.zeros(word_count, np.uint32), "STORAGE")
    return picture.packed[word_count]
