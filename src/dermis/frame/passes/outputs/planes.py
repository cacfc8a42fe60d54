"""Space for the outputs of a stage, one after the other in a buffer, and the pass that fills it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.outputs import OUTPUTS
from dermis.frame.passes import program
from dermis.frame.passes.visibility_buffer import Layers
from dermis.frame.shape import Shape
from dermis.gpu import ComputeProgram, Constants, Device, Recorder

_WORD = 4  # bytes


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
    buffer: Any

    @property
    def constants(self) -> Constants:
        """Pipeline constants: where each output begins."""
        return tuple((f"{name.upper()}_FIRST", first) for name, first in self._firsts().items())

    def place(self, name: str) -> tuple[int, int]:
        """Where an output begins in the buffer, and its length [byte]."""
        plane = _WORD * self.size[0] * self.size[1]
        return plane * self._firsts()[name], plane * self.channels[name]

    def arrays(self, raw: NDArray[np.uint8]) -> dict[str, NDArray[Any]]:
        """(h, w) or (h, w, channels) of each output, of the whole buffer's bytes."""
        found = {}
        for name in self.channels:
            start, size = self.place(name)
            found[name] = self.array(name, raw[start : start + size])
        return found

    def array(self, name: str, raw: NDArray[np.uint8]) -> NDArray[Any]:
        """The same of one output's bytes."""
        output, (width, height) = OUTPUTS[name], self.size
        words: NDArray[Any] = raw.view({"f": np.float32, "i": np.int32, "u": np.uint32}[_kind(name)])
        shape = (height, width) if output.channels == 1 else (height, width, self.channels[name])
        return words.reshape(shape).astype(output.kind, copy=False)

    def _firsts(self) -> dict[str, int]:
        firsts, first = {}, 0
        for name, count in self.channels.items():
            firsts[name] = first
            first += count
        return firsts


class Drawn(NamedTuple):
    """What the frame's own passes leave for its outputs.

    centres : texture of the triangles at the pixels' centres
    below : what the shading read as `scattered`
    """

    centres: Any
    below: Any


@dataclass(frozen=True, eq=False)
class OutputResources:
    """Space for a frame's outputs.

    names : as they were asked
    planes : a buffer for each stage that makes some
    centres : triangles at the pixels' centres; None where the picture's only sample lies there
    before : the shape in the scene before, None where nothing reads it
    light : what outputs of light take besides, a `LightSpace`
    labels : what labels are made from, a `LabelSpace`
    landmarks : those that are asked, a `LandmarkSpace`, or None
    """

    names: tuple[str, ...]
    planes: tuple[Planes, ...]
    centres: Layers | None
    before: Shape | None
    light: Any
    labels: Any
    landmarks: Any

    @property
    def buffers(self) -> list[Any]:
        """Those that are read back, in order."""
        last = [self.landmarks.buffer] if self.landmarks else []
        return [*(planes.buffer for planes in self.planes), *last]

    def planes_of(self, name: str) -> Planes:
        """Those that hold an output."""
        return next(planes for planes in self.planes if name in planes.channels)


def make_planes(
    device: Device, stage: str, channels: tuple[tuple[str, int], ...], size: tuple[int, int]
) -> Planes:
    """Space for outputs and their numbers of channels, in a picture of size (width, height).

    Raises DermisError for more than the device has in one buffer.
    """
    pixels, count = size[0] * size[1], max(1, sum(number for _, number in channels))
    if _WORD * count * pixels > device.max_storage_bytes:
        most = device.max_storage_bytes // (_WORD * count)
        limit = f"at most {most} pixels with {', '.join(name for name, _ in channels)}"
        came = f"there are {pixels}"
        refuse("size", f"{limit} at once from {device.adapter.name}", came, "Ask for fewer, or a smaller one")
    return Planes(stage, dict(channels), size, device.space(_WORD * count * pixels, "outputs"))


def stage_program(device: Device, planes: Planes, constants: Constants = ()) -> ComputeProgram:
    """The shader of a stage for the outputs that are asked.

    constants : of the surface and the lights, for stages that take them
    """
    return program(device, f"outputs/{planes.stage}.wgsl", (*planes.constants, *constants))


def draw(graph: Recorder, planes: Planes, shader: ComputeProgram, bound: Mapping[str, Any]) -> None:
    """Fill the planes.

    bound : what the stage reads, by names in its shader
    """
    graph.compute("outputs", shader, {**bound, "planes": planes.buffer}, planes.size)


def _kind(name: str) -> str:
    return np.dtype(OUTPUTS[name].kind).kind
