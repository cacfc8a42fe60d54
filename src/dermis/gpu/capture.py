"""Frames written down so that another program can run them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, TypeVar, TypeVarTuple, cast

import numpy as np
from numpy.typing import NDArray

from dermis.gpu.device import Device
from dermis.gpu.graph import Graph
from dermis.gpu.program import ComputeProgram, FragmentProgram, Program, RasterProgram
from dermis.gpu.recorder import DrawTarget, Groups, Recorder
from dermis.gpu.shader_types import Binding, record_type
from dermis.gpu.textures import download
from dermis.gpu.types import (
    Bindable,
    Bindings,
    Buffer,
    Record,
    TextureOrView,
    Untyped,
    is_buffer,
    is_sampler,
    is_texture,
    is_view,
)

T = TypeVar("T")

Ts = TypeVarTuple("Ts")

Description = dict[str, Any]
"""Plain data for JSON."""
Bound = list[int]
"""In the order of the program's bindings: numbers of resources, and -1 - k for the take's record k."""


@dataclass
class CapturedPass:
    """One pass.

    program, bound : None and empty where the host writes bytes into a resource
    groups : workgroups, or vertices of a raster pass
    completes : number of the resource that it completes from its own content, -1 for none
    raster : of a raster pass its layer, index buffer, depth view and its start, and target; -1 for none
    written : resource and bytes that the host writes
    unit : number of the recording that it is part of, which runs as a whole; a pass alone has one of its own
    """

    stage: str
    program: int | None
    bound: Bound
    groups: tuple[int, ...]
    completes: int = -1
    raster: dict[str, float] | None = None
    written: tuple[int, bytes] | None = None
    unit: int = 0


@dataclass
class CapturedFrame:
    """A frame.

    records : what passes read besides resources, each with the structure that names its members
    """

    passes: list[CapturedPass] = field(default_factory=list)
    records: list[tuple[str, Record]] = field(default_factory=list)
    _known: dict[int, int] = field(default_factory=dict)

    def add(self, one: CapturedPass, unit: int | None) -> None:
        """Add a pass, of a recording if it is part of one."""
        before = self.passes[-1].unit if self.passes else -1
        one.unit = before + 1 if unit is None else unit
        self.passes.append(one)

    def record(self, struct: str, record: Record) -> int:
        """The number of a record."""
        if id(record) not in self._known:
            self._known[id(record)] = len(self.records)
            self.records.append((struct, record))  # which keeps it, and with it its id
        return self._known[id(record)]


class FrameCapture(Graph):
    """Takes down frames that are declared on it, none of which runs.

    shaders : texts
    programs : each a shader with its constants, bindings and, if it rasterises, its targets
    resources : each described, see `described`
    structs : by their names, the records' members
    """

    def __init__(self, device: Device) -> None:
        super().__init__(device)
        self.shaders: list[str] = []
        self.programs: list[Description] = []
        self.resources: list[Description] = []
        self.structs: dict[str, np.dtype[np.generic]] = {}
        self._objects: list[Bindable] = []
        self._numbers: dict[int, int] = {}
        self._take = CapturedFrame()
        self._unit: int | None = None
        self._taken: dict[int, int] = {}
        self._kept: list[Program] = []

    def take(self, declare: Callable[[FrameCapture], object]) -> CapturedFrame:
        """The frame that `declare` declares."""
        self._take = take = CapturedFrame()
        self._unit = None
        declare(self)
        return take

    def content(self, number: int) -> list[NDArray[np.uint8]]:
        """The bytes that a resource holds now: of a texture those of each layer, mip by mip."""
        return content_of(self.device, self._objects[number])

    def object(self, number: int) -> Untyped:
        """A resource by its number."""
        return self._objects[number]

    def resource(self, value: Bindable) -> int:
        """The number of a texture, view, buffer or sampler."""
        if id(value) not in self._numbers:
            if is_view(value):
                found: Description = {"kind": "view", "part": value.part, "of": self.resource(value.texture)}
            else:
                found = description_of(self.device, value)
            self._numbers[id(value)] = len(self.resources)
            self.resources.append(found)
            self._objects.append(value)
        return self._numbers[id(value)]

    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Bindings, groups: Groups, completes: str = ""
    ) -> None:
        """Take a pass down."""
        taken = self._pass(stage, program, resources, groups)
        taken.completes = self.resource(resources[completes]) if completes else -1

    def write(self, stage: str, buffer: Buffer, data: bytes) -> None:
        """Take down what the host writes."""
        written = self.resource(buffer), data
        self._take.add(CapturedPass(stage, None, [], (len(data),), written=written), self._unit)

    def draw(
        self,
        stage: str,
        program: RasterProgram,
        resources: Bindings,
        vertices: int,
        target: DrawTarget,
        *,
        indices: Buffer | None = None,
        layer: int = 0,
    ) -> None:
        """Write down a pass that rasterises."""
        attached = {"indices": indices, "depth": target.depth, "target": target.colour}
        numbers = {name: -1 if one is None else self.resource(one) for name, one in attached.items()}
        taken = self._pass(stage, program, resources, (vertices,))
        taken.raster = {"layer": layer, "far": target.far, **numbers}

    def fill(
        self, stage: str, program: FragmentProgram, resources: Bindings, targets: Sequence[TextureOrView]
    ) -> None:
        """Nothing that is taken down fills targets."""
        raise NotImplementedError(f"{stage}: passes that fill targets are not taken down")

    def repeat(self, record: Callable[[Recorder, *Ts], T], *args: *Ts) -> T:
        """Take down the passes of `record(tape, *args)`, which run as a whole."""
        if self._unit is not None:
            return record(self, *args)
        passes = self._take.passes
        self._unit = passes[-1].unit + 1 if passes else 0
        try:
            return record(self, *args)
        finally:
            self._unit = None

    def _pass(
        self, stage: str, program: Program, resources: Bindings, groups: tuple[int, ...]
    ) -> CapturedPass:
        bound = [self._bound(program, one, resources[one.name]) for one in program.bindings]
        taken = CapturedPass(stage, self._program(program), bound, groups)
        self._take.add(taken, self._unit)
        return taken

    def _bound(self, program: Program, binding: Binding, value: Bindable) -> int:
        if not isinstance(value, np.ndarray):
            return self.resource(value)
        struct = record_type(program.source.text, binding.name)
        self.structs[struct] = value.dtype
        return -1 - self._take.record(struct, cast("Record", value))

    def _program(self, program: Program) -> int:
        if id(program) not in self._taken:
            self._taken[id(program)] = len(self.programs)
            self._kept.append(program)
            self.programs.append(
                {
                    "name": program.name,
                    "shader": self._shader(program.source.text),
                    "constants": dict(program.constants),
                    "bindings": [(one.index, one.name, one.entry) for one in program.bindings],
                    "raster": program.drawn if isinstance(program, RasterProgram) else None,
                }
            )
        return self._taken[id(program)]

    def _shader(self, text: str) -> int:
        if text not in self.shaders:
            self.shaders.append(text)
        return self.shaders.index(text)


def description_of(device: Device, value: Bindable) -> Description:
    """What it takes to make a resource: its kind, sizes and uses by WebGPU's numbers, or options."""
    if is_texture(value):
        size, mips = list(value.size), value.mip_level_count
        sizes = {"format": value.format, "size": size, "mips": mips, "usage": int(value.usage)}
        return {"kind": "texture", **sizes}
    if is_buffer(value):
        return {"kind": "buffer", "size": value.size, "usage": int(value.usage)}
    assert is_sampler(value)
    return {"kind": "sampler", "options": device.sampler_options(value)}


def content_of(device: Device, value: Bindable) -> list[NDArray[np.uint8]]:
    """The bytes of a buffer, or of a texture's layers, mip by mip and in a mip layer by layer."""
    if not is_texture(value):
        return [np.frombuffer(device.handle.queue.read_buffer(value), np.uint8)]
    parts = product(range(value.mip_level_count), range(value.size[2]))
    texels = [download(device, value, mip=mip, layer=layer) for mip, layer in parts]
    return [np.ascontiguousarray(one).view(np.uint8).reshape(-1) for one in texels]
