"""Capture of frames as data (shaders, programs, resources and passes), which web pages play back."""

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

PlainData = dict[str, Any]
"""Dictionary that can be written as JSON."""
BoundIndices = list[int]
"""For each binding of a program, the index of its resource, or -1 - k for uniform record k of the frame."""


@dataclass
class CapturedPass:
    """Pass of a captured frame.

    stage : name of the stage
    program : index of the program; None for a write from the host
    bound : for each binding of the program, the index of the resource, or -1 - k for the uniform record k;
        empty for a write from the host
    groups : for a compute pass, the workgroups along each axis; for a render pass, the number of vertices;
        for a write from the host, the number of bytes
    completes : index of the resource whose content the pass only completes, such as a map whose gutters it
        fills (see `Recorder.dispatch`); -1 if there is none
    raster : for a render pass, a dictionary of five numbers: the layer, the depth to which the pass clears,
        and the indices of three resources (index buffer, depth view, colour target), where -1 stands for a
        missing resource; None for other passes
    written : for a write from the host, the index of the buffer and the bytes; None for other passes
    unit : index of the unit to which the pass belongs; a unit is a single pass, or a group of passes
        that are run or skipped together
    """

    stage: str
    program: int | None
    bound: BoundIndices
    groups: tuple[int, ...]
    completes: int = -1
    raster: dict[str, float] | None = None
    written: tuple[int, bytes] | None = None
    unit: int = 0


@dataclass
class CapturedFrame:
    """Passes of a captured frame, and the uniform records that they read.

    records : for each record, the name of the WGSL struct and the content
    """

    passes: list[CapturedPass] = field(default_factory=list)
    records: list[tuple[str, UniformRecord]] = field(default_factory=list)
    _record_index: dict[int, int] = field(default_factory=dict)

    def add(self, captured_pass: CapturedPass, replay_unit_index: int | None) -> None:
        """Append a pass to the captured frame.

        replay_unit_index : index of the pass's unit, a group of passes that are run or skipped together; None
            for a pass that is run or skipped on its own
        """
        last = self.passes[-1].unit if self.passes else -1
        captured_pass.unit = last + 1 if replay_unit_index is None else replay_unit_index
        self.passes.append(captured_pass)

    def index_of_record(self, struct_name: str, record: UniformRecord) -> int:
        """Return the index of a uniform record in `records`, appending it on first use.

        struct_name : name of the WGSL struct of the record
        """
        if id(record) not in self._record_index:
            self._record_index[id(record)] = len(self.records)
            self.records.append((struct_name, record))  # kept alive, so that its id stays unique
        return self._record_index[id(record)]


class FrameCapture(Graph):
    """Recorder that captures the passes of a declared frame as data instead of running the passes.

    shaders : WGSL texts of the shaders
    programs : for each program, its shader, constants and bindings, and for render programs also depth test
        and target format
    resources : description of each resource, from `describe_resource`
    structs : dtypes of the uniform records by the name of their WGSL struct
    """

    def __init__(self, device: Device) -> None:
        super().__init__(device)
        self.shaders: list[str] = []
        self.programs: list[PlainData] = []
        self.resources: list[PlainData] = []
        self.structs: dict[str, np.dtype[np.generic]] = {}
        self._objects: list[Bindable] = []
        self._resource_index: dict[int, int] = {}
        self._frame = CapturedFrame()
        self._unit: int | None = None
        self._program_index: dict[int, int] = {}
        self._program_objects: list[Program] = []  # kept alive, so that their ids stay unique

    def capture(self, declare_frame: Callable[[FrameCapture], object]) -> CapturedFrame:
        """Return the passes and records of the frame that `declare_frame` declares on this recorder."""
        self._frame = frame = CapturedFrame()
        self._unit = None
        declare_frame(self)
        return frame

    def read_content(self, resource_index: int) -> list[NDArray[np.uint8]]:
        """Download a resource: return the bytes of a buffer, or of each image of a texture.

        A texture has one image per layer and mip level; all layers of a mip level come before the next mip
        level.

        resource_index : index of the resource in `resources`
        """
        value = self._objects[resource_index]
        if not is_texture(value):
            return [np.frombuffer(self.device.handle.queue.read_buffer(value), np.uint8)]
        parts = product(range(value.mip_level_count), range(value.size[2]))
        texels = [download(self.device, value, mip=mip, layer=layer) for mip, layer in parts]
        return [np.ascontiguousarray(one).view(np.uint8).reshape(-1) for one in texels]

    def resource_at(self, resource_index: int) -> Untyped:
        """Return the captured texture, view, buffer or sampler that `resources[resource_index]` describes."""
        return self._objects[resource_index]

    def index_of_resource(self, bound_object: Bindable) -> int:
        """Return the index of a texture, view, buffer or sampler in `resources`, adding it on first use."""
        if id(bound_object) not in self._resource_index:
            if is_view(bound_object):
                found: PlainData = {
                    "kind": "view",
                    "part": bound_object.layer_and_mip,
                    "of": self.index_of_resource(bound_object.texture),
                }
            else:
                found = describe_resource(self.device, bound_object)
            self._resource_index[id(bound_object)] = len(self.resources)
            self.resources.append(found)
            self._objects.append(bound_object)
        return self._resource_index[id(bound_object)]

    def dispatch(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Bindings,
        workgroups: Workgroups,
        in_place_resource: str = "",
    ) -> None:
        """Capture a compute pass instead of running it."""
        captured = self._add_pass(stage, program, resources, workgroups)
        captured.completes = self.index_of_resource(resources[in_place_resource]) if in_place_resource else -1

    def write(self, stage: str, buffer: Buffer, content: bytes) -> None:
        """Capture a write of bytes from the host to a buffer."""
        written = self.index_of_resource(buffer), content
        self._frame.add(CapturedPass(stage, None, [], (len(content),), written=written), self._unit)

    def draw(
        self,
        stage: str,
        program: RenderProgram,
        resources: Bindings,
        vertex_count: int,
        target: DrawTarget,
        *,
        index_buffer: Buffer | None = None,
        instance_index: int = 0,
    ) -> None:
        """Capture a render pass of triangles instead of running it."""
        attachments = {"indices": index_buffer, "depth": target.depth, "target": target.colour}
        indices_of = {
            name: -1 if one is None else self.index_of_resource(one) for name, one in attachments.items()
        }
        captured = self._add_pass(stage, program, resources, (vertex_count,))
        captured.raster = {"layer": instance_index, "far": target.clear_depth, **indices_of}

    def draw_fullscreen(
        self, stage: str, program: RenderProgram, resources: Bindings, targets: Sequence[TextureOrView]
    ) -> None:
        """Raise NotImplementedError, as programs that replay a captured frame do not support such passes."""
        raise NotImplementedError(f"{stage}: passes that fill targets cannot be captured")

    def add_replayable(self, record_passes: Callable[[Recorder, *Ts], T], *args: *Ts) -> T:
        """Capture all passes of `record_passes(recorder, *args)` as one unit, and return its result.

        A program that replays the captured frame runs either all passes of a unit or none. Within another
        call of `add_replayable`, the passes belong to the unit of the outer call.
        """
        if self._unit is not None:
            return record_passes(self, *args)
        passes = self._frame.passes
        self._unit = passes[-1].unit + 1 if passes else 0
        try:
            return record_passes(self, *args)
        finally:
            self._unit = None

    def _add_pass(
        self, stage: str, program: Program, resources: Bindings, workgroups: tuple[int, ...]
    ) -> CapturedPass:
        bound = [self._binding_index(program, one, resources[one.name]) for one in program.bindings]
        captured = CapturedPass(stage, self._index_of_program(program), bound, workgroups)
        self._frame.add(captured, self._unit)
        return captured

    def _binding_index(self, program: Program, binding: Binding, bound_object: Bindable) -> int:
        if not isinstance(bound_object, np.ndarray):
            return self.index_of_resource(bound_object)
        struct = uniform_type(program.source.text, binding.name)
        self.structs[struct] = bound_object.dtype
        return -1 - self._frame.index_of_record(struct, cast("UniformRecord", bound_object))

    def _index_of_program(self, program: Program) -> int:
        if id(program) not in self._program_index:
            self._program_index[id(program)] = len(self.programs)
            self._program_objects.append(program)
            self.programs.append(
                {
                    "name": program.name,
                    "shader": self._index_of_shader(program.source.text),
                    "constants": dict(program.constants),
                    "bindings": [(one.index, one.name, one.entry) for one in program.bindings],
                    "raster": program.raster if isinstance(program, RenderProgram) else None,
                }
            )
        return self._program_index[id(program)]

    def _index_of_shader(self, wgsl_text: str) -> int:
        if wgsl_text not in self.shaders:
            self.shaders.append(wgsl_text)
        return self.shaders.index(wgsl_text)


def describe_resource(device: Device, resource: Bindable) -> PlainData:
    """Return the parameters that are needed to create a resource again, as plain data for JSON.

    The parameters of a texture are its size, format, number of mip levels and usage flags. A buffer has only
    a size and usage flags, and a sampler has its options.
    """
    if is_texture(resource):
        size, mips = list(resource.size), resource.mip_level_count
        sizes = {"format": resource.format, "size": size, "mips": mips, "usage": int(resource.usage)}
        return {"kind": "texture", **sizes}
    if is_buffer(resource):
        return {"kind": "buffer", "size": resource.size, "usage": int(resource.usage)}
    assert is_sampler(resource)
    return {"kind": "sampler", "options": device.sampler_options(resource)}
