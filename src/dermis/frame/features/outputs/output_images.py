"""Buffer for the outputs of a shader, one image after another, and the pass that fills the buffer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.programs import program
from dermis.gpu import Bindings, Buffer, ComputeProgram, Constants, Device, Recorder
from dermis.scene.outputs import OUTPUTS

_WORD_BYTES = 4  # size of a word [bytes]
OutputArray = NDArray[Any]  # callers know the dtype by the output's name
"""Array of an output: float32, int32 or uint8, see `OUTPUTS`."""


@dataclass(frozen=True, eq=False)
class OutputImages:
    """Buffer for the outputs of a shader: one image after another, with interleaved channels.

    stage : name of the shader that fills the buffer
    channels : number of channels of each output, in the order of the buffer
    size : (width, height) [pixel]
    buffer : one word per pixel and channel, see output_images.wgsl
    """

    stage: str
    channels: Mapping[str, int]
    size: tuple[int, int]
    buffer: Buffer

    @property
    def first_channel_constants(self) -> Constants:
        """Return the pipeline constants that tell the shader where each output starts in the buffer."""
        return tuple((f"{name.upper()}_FIRST", first) for name, first in self._first_channels().items())

    def first_channel_constant(self, output_name: str) -> Constants:
        """Return the pipeline constant that tells the shader where an output starts in the buffer."""
        return ((f"{output_name.upper()}_FIRST", self._first_channels()[output_name]),)

    def byte_range(self, output_name: str) -> tuple[int, int]:
        """Return the offset of an output in the buffer, and its length [byte]."""
        plane = _WORD_BYTES * self.size[0] * self.size[1]
        return plane * self._first_channels()[output_name], plane * self.channels[output_name]

    def decode_outputs(self, buffer_bytes: NDArray[np.uint8]) -> dict[str, OutputArray]:
        """Return each output as an (h, w) or (h, w, channels) array.

        buffer_bytes : bytes of the whole buffer
        """
        ranges = {name: self.byte_range(name) for name in self.channels}
        return {
            name: self.decode_output(name, buffer_bytes[start : start + size])
            for name, (start, size) in ranges.items()
        }

    def decode_output(self, output_name: str, output_bytes: NDArray[np.uint8]) -> OutputArray:
        """Return one output as an (h, w) or (h, w, channels) array.

        output_bytes : bytes of the buffer in the range that `byte_range` returns
        """
        output, (width, height) = OUTPUTS[output_name], self.size
        kind = np.dtype(output.kind).kind
        words: OutputArray = output_bytes.view({"f": np.float32, "i": np.int32, "u": np.uint32}[kind])
        shape = (height, width) if output.channels == 1 else (height, width, self.channels[output_name])
        return words.reshape(shape).astype(output.kind, copy=False)

    def _first_channels(self) -> dict[str, int]:
        firsts, first = {}, 0
        for name, count in self.channels.items():
            firsts[name] = first
            first += count
        return firsts


def make_output_images(
    device: Device,
    stage_name: str,
    channel_counts: tuple[tuple[str, int], ...],
    picture_size: tuple[int, int],
) -> OutputImages:
    """Allocate the buffer for the outputs of a shader, for a picture of size (width, height).

    stage_name : name of the shader that fills the buffer
    channel_counts : (name, number of channels) of each output

    Raises DermisError if the outputs do not fit in one buffer of the device.
    """
    pixels, count = picture_size[0] * picture_size[1], max(1, sum(number for _, number in channel_counts))
    if _WORD_BYTES * count * pixels > device.max_storage_bytes:
        most = device.max_storage_bytes // (_WORD_BYTES * count)
        limit = f"at most {most} pixels with {', '.join(name for name, _ in channel_counts)}"
        actual = f"there are {pixels}"
        refuse(
            "size", f"{limit} at once from {device.adapter.name}", actual, "Ask for fewer, or a smaller one"
        )
    return OutputImages(
        stage_name,
        dict(channel_counts),
        picture_size,
        device.storage_buffer(_WORD_BYTES * count * pixels, "outputs"),
    )


def stage_program(device: Device, output_images: OutputImages, constants: Constants = ()) -> ComputeProgram:
    """Return the program that computes the requested outputs of a shader.

    output_images : buffer of these outputs
    constants : pipeline constants of the surface and the lights, for shaders that need them
    """
    return program(
        device, f"outputs/{output_images.stage}.wgsl", (*output_images.first_channel_constants, *constants)
    )


def draw_output_images(
    graph: Recorder, output_images: OutputImages, shader: ComputeProgram, bindings: Bindings
) -> None:
    """Declare the pass that computes the outputs of a shader for each pixel.

    output_images : buffer to fill with the outputs
    shader : program that computes the outputs
    bindings : resources of the shader, apart from the buffer for the outputs
    """
    graph.compute("outputs", shader, {**bindings, "output_images": output_images.buffer}, output_images.size)
