"""Capture of frames, so that another program can run them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, TypeVar, TypeVarTuple, cast

import numpy as np
from numpy.typing import NDArray

from dermis.gpu.device import Device
from dermis.gpu.graph import Graph
from dermis.gpu.program import ComputeProgram, Program, RenderProgram
from dermis.gpu.recorder import DrawTarget, Recorder, Workgroups
from dermis.gpu.shader_types import Binding, uniform_type
from dermis.gpu.textures import download
from dermis.gpu.types import (
    Bindable,
    Bindings,
    Buffer,
    TextureOrView,
    UniformRecord,
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
"""For each binding of the program the index of a resource, or -1 - k for record k of the frame."""


@dataclass
class CapturedPass:
    """A pass of a captured frame.

    program, bound : index of the program and what it binds; None and empty where the host writes to a buffer
    groups : workgroups along each axis, or number of vertices of a render pass
    completes : index of the resource that the pass extends in place (see `Recorder.dispatch`), -1 for none
    raster : for a render pass its layer, clear depth, and indices of index buffer, depth view and target; -1
        for none
    written : buffer and bytes that the host writes
    unit : index of the recording that the pass belongs to, which runs as a whole; other passes have their own
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
    """Passes of a captured frame and the uniform records that they read.

    records : name of the WGSL struct and content of each record
    """

    passes: list[CapturedPass] = field(default_factory=list)
    records: list[tuple[str, UniformRecord]] = field(default_factory=list)
    _record_index: dict[int, int] = field(default_factory=dict)

    def add(self, one: CapturedPass, unit: int | None) -> None:
        """Add a pass.

        unit : index of the recording that it belongs to, if any
        """
        last = self.passes[-1].unit if self.passes else -1
        one.unit = last + 1 if unit is None else unit
        self.passes.append(one)

    def record(self, struct: str, record: UniformRecord) -> int:
        """Return the index of a record, which is added if it is new."""
        if id(record) not in self._record_index:
            self._record_index[id(record)] = len(self.records)
            self.records.append((struct, record))  # kept alive, so that its id stays unique
        return self._record_index[id(record)]


class FrameCapture(Graph):
    """Recorder that captures the frames declared on it instead of running them.

    shaders : texts of the shaders
    programs : shader, constants, bindings and, for render programs, targets of each program
    resources : description of each resource, see `describe_resource`
    structs : dtypes of the records by the name of their struct
    """

    def __init__(self, device: Device) -> None:
        super().__init__(device)
        self.shaders: list[str] = []
        self.programs: list[Description] = []
        self.resources: list[Description] = []
        self.structs: dict[str, np.dtype[np.generic]] = {}
        self._objects: list[Bindable] = []
        self._resource_index: dict[int, int] = {}
        self._frame = CapturedFrame()
        self._unit: int | None = None
        self._program_index: dict[int, int] = {}
        self._program_objects: list[Program] = []  # kept alive, so that their ids stay unique

    def capture(self, declare: Callable[[FrameCapture], object]) -> CapturedFrame:
        """Return the frame that `declare(self)` declares."""
        self._frame = frame = CapturedFrame()
        self._unit = None
        declare(self)
        return frame

    def read_content(self, index: int) -> list[NDArray[np.uint8]]:
        """Return the bytes of a buffer, or of each layer of a texture, mip level by mip level."""
        value = self._objects[index]
        if not is_texture(value):
            return [np.frombuffer(self.device.handle.queue.read_buffer(value), np.uint8)]
        parts = product(range(value.mip_level_count), range(value.size[2]))
        texels = [download(self.device, value, mip=mip, layer=layer) for mip, layer in parts]
        return [np.ascontiguousarray(one).view(np.uint8).reshape(-1) for one in texels]

    def resource_at(self, index: int) -> Untyped:
        """Return a resource by its index."""
        return self._objects[index]

    def resource(self, value: Bindable) -> int:
        """Return the index of a texture, view, buffer or sampler, which is added if it is new."""
        if id(value) not in self._resource_index:
            if is_view(value):
                found: Description = {
                    "kind": "view",
                    "part": value.layer_and_mip,
                    "of": self.resource(value.texture),
                }
            else:
                found = describe_resource(self.device, value)
            self._resource_index[id(value)] = len(self.resources)
            self.resources.append(found)
            self._objects.append(value)
        return self._resource_index[id(value)]

    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Bindings, groups: Workgroups, in_place: str = ""
    ) -> None:
        """Capture a compute pass."""
        captured = self._add_pass(stage, program, resources, groups)
        captured.completes = self.resource(resources[in_place]) if in_place else -1

    def write(self, stage: str, buffer: Buffer, data: bytes) -> None:
        """Capture a write from the host."""
        written = self.resource(buffer), data
        self._frame.add(CapturedPass(stage, None, [], (len(data),), written=written), self._unit)

    def draw(
        self,
        stage: str,
        program: RenderProgram,
        resources: Bindings,
        vertices: int,
        target: DrawTarget,
        *,
        indices: Buffer | None = None,
        layer: int = 0,
    ) -> None:
        """Capture a render pass of triangles."""
        attachments = {"indices": indices, "depth": target.depth, "target": target.colour}
        numbers = {name: -1 if one is None else self.resource(one) for name, one in attachments.items()}
        captured = self._add_pass(stage, program, resources, (vertices,))
        captured.raster = {"layer": layer, "far": target.clear_depth, **numbers}

    def fill(
        self, stage: str, program: RenderProgram, resources: Bindings, targets: Sequence[TextureOrView]
    ) -> None:
        """Raise NotImplementedError: no player can run passes that fill targets."""
        raise NotImplementedError(f"{stage}: passes that fill targets cannot be captured")

    def repeat(self, record: Callable[[Recorder, *Ts], T], *args: *Ts) -> T:
        """Capture the passes of `record(self, *args)`, which run as a whole."""
        if self._unit is not None:
            return record(self, *args)
        passes = self._frame.passes
        self._unit = passes[-1].unit + 1 if passes else 0
        try:
            return record(self, *args)
        finally:
            self._unit = None

    def _add_pass(
        self, stage: str, program: Program, resources: Bindings, groups: tuple[int, ...]
    ) -> CapturedPass:
        bound = [self._bound(program, one, resources[one.name]) for one in program.bindings]
        captured = CapturedPass(stage, self._program(program), bound, groups)
        self._frame.add(captured, self._unit)
        return captured

    def _bound(self, program: Program, binding: Binding, value: Bindable) -> int:
        if not isinstance(value, np.ndarray):
            return self.resource(value)
        struct = uniform_type(program.source.text, binding.name)
        self.structs[struct] = value.dtype
        return -1 - self._frame.record(struct, cast("UniformRecord", value))

    def _program(self, program: Program) -> int:
        if id(program) not in self._program_index:
            self._program_index[id(program)] = len(self.programs)
            self._program_objects.append(program)
            self.programs.append(
                {
                    "name": program.name,
                    "shader": self._shader(program.source.text),
                    "constants": dict(program.constants),
                    "bindings": [(one.index, one.name, one.entry) for one in program.bindings],
                    "raster": program.raster if isinstance(program, RenderProgram) else None,
                }
            )
        return self._program_index[id(program)]

    def _shader(self, text: str) -> int:
        if text not in self.shaders:
            self.shaders.append(text)
        return self.shaders.index(text)


def describe_resource(device: Device, value: Bindable) -> Description:
    """Return what is needed to create a resource: its kind, and its sizes and usage flags or its options."""
    if is_texture(value):
        size, mips = list(value.size), value.mip_level_count
        sizes = {"format": value.format, "size": size, "mips": mips, "usage": int(value.usage)}
        return {"kind": "texture", **sizes}
    if is_buffer(value):
        return {"kind": "buffer", "size": value.size, "usage": int(value.usage)}
    assert is_sampler(value)
    return {"kind": "sampler", "options": device.sampler_options(value)}
