"""Space for the outputs of a stage, one after the other in a buffer, and the pass that fills it."""

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

_WORD = 4  # bytes
PlaneArray = NDArray[Any]  # callers know the dtype by the output's name
"""An output as an array: float32, int32 or uint8, as its line in `OUTPUTS` says."""


@dataclass(frozen=True, eq=False)
class Planes:
    """The outputs of a stage.

    stage : name of its shader
    channels : of each output, in order
    size : (width, height) [pixel]
    buffer : of words, see planes.wgsl
    """

    stage: str
    channels: Mapping[str, int]
    size: tuple[int, int]
    buffer: Buffer

    @property
    def constants(self) -> Constants:
        """Pipeline constants: where each output begins."""
        return tuple((f"{name.upper()}_FIRST", first) for name, first in self._firsts().items())

    def first(self, name: str) -> Constants:
        """Return the pipeline constant of one output alone."""
        return ((f"{name.upper()}_FIRST", self._firsts()[name]),)

    def place(self, name: str) -> tuple[int, int]:
        """Return where an output begins in the buffer, and its length [byte]."""
        plane = _WORD * self.size[0] * self.size[1]
        return plane * self._firsts()[name], plane * self.channels[name]

    def arrays(self, raw: NDArray[np.uint8]) -> dict[str, PlaneArray]:
        """Return each output as (h, w) or (h, w, channels), from the bytes of the whole buffer."""
        found = {}
        for name in self.channels:
            start, size = self.place(name)
            found[name] = self.array(name, raw[start : start + size])
        return found

    def array(self, name: str, raw: NDArray[np.uint8]) -> PlaneArray:
        """Return one output as (h, w) or (h, w, channels), from its own bytes."""
        output, (width, height) = OUTPUTS[name], self.size
        words: PlaneArray = raw.view({"f": np.float32, "i": np.int32, "u": np.uint32}[_kind(name)])
        shape = (height, width) if output.channels == 1 else (height, width, self.channels[name])
        return words.reshape(shape).astype(output.kind, copy=False)

    def _firsts(self) -> dict[str, int]:
        firsts, first = {}, 0
        for name, count in self.channels.items():
            firsts[name] = first
            first += count
        return firsts


def make_planes(
    device: Device, stage: str, channels: tuple[tuple[str, int], ...], size: tuple[int, int]
) -> Planes:
    """Allocate outputs with their numbers of channels, for a picture of size (width, height).

    Raises DermisError for more than the device has in one buffer.
    """
    pixels, count = size[0] * size[1], max(1, sum(number for _, number in channels))
    if _WORD * count * pixels > device.max_storage_bytes:
        most = device.max_storage_bytes // (_WORD * count)
        limit = f"at most {most} pixels with {', '.join(name for name, _ in channels)}"
        actual = f"there are {pixels}"
        refuse("size", f"{limit} at once from {device.adapter.name}", actual, "Ask for fewer, or a smaller one")
    return Planes(stage, dict(channels), size, device.storage_buffer(_WORD * count * pixels, "outputs"))


def stage_program(device: Device, planes: Planes, constants: Constants = ()) -> ComputeProgram:
    """Return the shader of a stage for the requested outputs.

    constants : of the surface and the lights, for stages that take them
    """
    return program(device, f"outputs/{planes.stage}.wgsl", (*planes.constants, *constants))


def fill(graph: Recorder, planes: Planes, shader: ComputeProgram, bound: Bindings) -> None:
    """Declare the pass that fills the planes.

    bound : what the stage reads, by names in its shader
    """
    graph.compute("outputs", shader, {**bound, "planes": planes.buffer}, planes.size)


def _kind(name: str) -> str:
    return np.dtype(OUTPUTS[name].kind).kind
