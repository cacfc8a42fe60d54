"""Frame graph: passes are declared in order, and only passes with outdated output run."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar, TypeVarTuple

import numpy as np

from dermis.gpu.command_list import CommandList, Timing
from dermis.gpu.dependencies import Access, Dependencies, PassAccess, ResourceState, resource_state
from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram, Program, RenderProgram
from dermis.gpu.readback import BufferReadback
from dermis.gpu.recorder import DrawTarget, Recorder, Workgroups
from dermis.gpu.replay import RecordingCache
from dermis.gpu.types import Bindable, Bindings, Buffer, TextureOrView, is_buffer, is_texture, is_view
from dermis.gpu.uniforms import Uniforms

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
_MAX_CACHED_DEPENDENCIES = 8  # for frames that alternate, such as pictures, readbacks and several views


@dataclass
class FrameListingEntry:
    """Entry of a frame listing: one pass with its shader, bindings and whether it ran.

    stage : name of the stage
    shader : name of the shader file
    constants : pipeline constants by name
    bindings : dictionary from a name in the shader to what is bound: the index of a resource in the listing,
        "sampler", or for example "record 128" for a uniform record of 128 bytes
    groups : for a compute pass, the workgroups along each axis; for a render pass, the number of vertices;
        for a write from the host, the number of bytes
    recorded : whether the pass belongs to a recording, so that its uniform records never change
    ran : whether the pass ran in that frame
    """

    stage: str
    shader: str
    constants: dict[str, float]
    bindings: dict[str, int | str]
    groups: tuple[int, ...]
    recorded: bool = False
    ran: bool = False


@dataclass
class FrameListing:
    """Listing of a frame for inspection: its passes in order, and the resources that they bind.

    resources : descriptions such as "rgba32float 512 x 512 x 7" or "buffer 4096"
    """

    passes: list[FrameListingEntry] = field(default_factory=list)
    resources: list[str] = field(default_factory=list)
    _resource_index: dict[int, int] = field(default_factory=dict)
    _pass_index: list[int] = field(default_factory=list)

    def add(
        self,
        stage: str,
        program: Program,
        resources: Bindings,
        workgroups: Sequence[int],
        declared_index: int,
        recorded: bool = False,
    ) -> None:
        """Append a pass to the listing.

        stage : name of the stage
        workgroups : see `FrameListingEntry.groups`
        declared_index : index of the pass among those declared on the graph; all passes of a recording have
            the same index, because a recording is declared as one pass
        recorded : whether the pass belongs to a recording
        """
        bindings = {one.name: self._describe_binding(resources[one.name]) for one in program.bindings}
        listed = FrameListingEntry(
            stage, program.name, dict(program.constants), bindings, tuple(workgroups), recorded
        )
        self.passes.append(listed)
        self._pass_index.append(declared_index)

    def add_write(self, stage: str, buffer: Buffer, byte_count: int, declared_index: int) -> None:
        """Append a write of `byte_count` bytes from the host to a buffer.

        declared_index : index of the write among the passes declared on the graph
        """
        self.passes.append(
            FrameListingEntry(
                stage, "from the host", {}, {"written": self._describe_binding(buffer)}, (byte_count,)
            )
        )
        self._pass_index.append(declared_index)

    def mark_passes_that_ran(self, did_declared_pass_run: Sequence[bool]) -> None:
        """After the frame, store in `FrameListingEntry.ran` of each listed pass whether it ran.

        did_declared_pass_run : for each declared pass, whether it ran
        """
        for one, index in zip(self.passes, self._pass_index, strict=True):
            one.ran = did_declared_pass_run[index]

    def _describe_binding(self, bound_object: Bindable) -> int | str:
        if isinstance(bound_object, np.ndarray):
            return f"record {bound_object.nbytes}"
        description = _describe_resource(bound_object)
        if description == "sampler":
            return description
        if id(bound_object) not in self._resource_index:
            self._resource_index[id(bound_object)] = len(self.resources)
            self.resources.append(description)
        return self._resource_index[id(bound_object)]


class ListingRecorder(Recorder):
    """Recorder that only adds the passes of a recording (see `Recording`) to a listing.

    listing : listing that receives the passes
    declared_index : index of the recording among the passes declared on the graph
    """

    def __init__(self, device: Device, listing: FrameListing, declared_index: int) -> None:
        self.device, self._listing, self._index = device, listing, declared_index

    def dispatch(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Bindings,
        workgroups: Workgroups,
        in_place_resource: str = "",
    ) -> None:
        """Append a compute pass to the listing instead of running it."""
        self._listing.add(stage, program, resources, workgroups, self._index, recorded=True)


def _describe_resource(resource: Bindable) -> str:
    if is_view(resource):
        return f"view of {_describe_resource(resource.texture)}"
    if is_texture(resource):
        width, height, layers = resource.size
        return f"{resource.format} {width} x {height} x {layers}"
    return f"buffer {resource.size}" if is_buffer(resource) else "sampler"


@dataclass(slots=True)
class DeclaredPass:
    """Pass declared on a graph, or all passes of a recording, which are run or skipped together.

    stages : names of the stages of the pass or passes
    run : function that adds the pass, or the passes, to a command list
    key : everything that the output depends on besides the resources that are read
    access : `Access.id`, which identifies the combination of program and resources; and the states of the
        resources that are read and written
    """

    stages: tuple[str, ...]
    run: Callable[[CommandList], None]
    key: Hashable
    access: PassAccess


class Graph(Recorder):
    """Frame graph: a recorder that runs only those declared passes whose output is outdated.

    The resources that a pass reads and writes follow from the bindings of its shader. The version of its
    outputs, a number that identifies their content, is a hash of the program, the resources and their
    versions, the workgroups, and the uniforms that the shader reads. A pass is skipped if its outputs already
    have that version. It is also skipped if no pass that runs reads its outputs, and each output is
    overwritten later or is not needed after the frame (see `mark_scratch`).

    recordings : cache of the recordings that `add_replayable` makes
    executed_stages : stages of the passes that ran in the last frame, in order
    listing : object that lists the passes of the next frame and whether they ran, for inspection; None if the
        next frame is not listed
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.recordings = RecordingCache()
        self.executed_stages: list[str] = []
        self.listing: FrameListing | None = None
        self._epoch = 0
        self._passes: list[DeclaredPass] = []
        self._uniforms = Uniforms(device)
        self._dependencies: list[Dependencies] = []  # dependencies of earlier frames, the latest first
        self._readbacks: list[tuple[tuple[Buffer, ...], BufferReadback]] = []

    def invalidate(self) -> None:
        """Mark the content of all resources as unknown, so that the next frame runs every pass."""
        self._epoch += 1

    def begin(self) -> None:
        """Begin a new frame: forget the passes that were declared for the last frame."""
        self._passes.clear()
        self._uniforms.clear()
        self._readbacks.clear()

    def dispatch(
        self,
        stage: str,
        program: ComputeProgram,
        resources: Bindings,
        workgroups: Workgroups,
        in_place_resource: str = "",
    ) -> None:
        """Declare a dispatch of a compute program, see `Recorder.dispatch`."""
        access = program.resource_access(resources)
        writes = access.writes
        if in_place_resource:
            unchanged = resource_state(self.device, resources[in_place_resource])
            writes = tuple(state for state in writes if state is not unchanged)

        def add_dispatch(frame: CommandList) -> None:
            frame.dispatch(stage, program, resources, workgroups, access=access)

        self._declare_pass(stage, program, resources, workgroups, access, writes, add_dispatch)

    def write(self, stage: str, buffer: Buffer, content: bytes) -> None:
        """Declare a write of bytes from the host to a buffer, see `Recorder.write`."""
        state = resource_state(self.device, buffer)

        def add_write(frame: CommandList) -> None:
            frame.write(stage, buffer, content)

        if self.listing is not None:
            self.listing.add_write(stage, buffer, len(content), len(self._passes))
        self._passes.append(DeclaredPass((stage,), add_write, content, (0, (), (state,))))

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
        """Declare a render pass of triangles, see `Recorder.draw`."""
        attachments = (target.depth, target.colour)
        writes = tuple(resource_state(self.device, one) for one in attachments if one is not None)

        def add_draw(frame: CommandList) -> None:
            frame.draw(
                stage,
                program,
                resources,
                vertex_count,
                target,
                index_buffer=index_buffer,
                instance_index=instance_index,
            )

        access = program.resource_access(resources)
        index_state = None if index_buffer is None else resource_state(self.device, index_buffer)
        more_keys = instance_index, target.clear_depth, index_state
        self._declare_pass(stage, program, resources, (vertex_count,), access, writes, add_draw, more_keys)

    def draw_fullscreen(
        self, stage: str, program: RenderProgram, resources: Bindings, targets: Sequence[TextureOrView]
    ) -> None:
        """Declare a pass that runs once per texel of its targets, see `Recorder.draw_fullscreen`."""
        writes = tuple(resource_state(self.device, one) for one in targets)

        def add_fullscreen_draw(frame: CommandList) -> None:
            frame.draw_fullscreen(stage, program, resources, targets)

        self._declare_pass(
            stage, program, resources, (3,), program.resource_access(resources), writes, add_fullscreen_draw
        )

    def add_replayable(self, record_passes: Callable[[Recorder, *Ts], T], *args: *Ts) -> T:
        """Declare the passes that `record_passes(recorder, *args)` adds, and return the result of the call.

        The passes are recorded once per set of arguments. Either all passes of a recording run, or none.
        Replaying a recording takes almost no time in Python.
        """
        recording, result = self.recordings.get(self.device, record_passes, args)
        if self.listing is not None:
            record_passes(ListingRecorder(self.device, self.listing, len(self._passes)), *args)
        stages, access, dispatches = recording.stages, recording.access, recording.dispatches
        found = access.id, access.reads, access.writes
        self._passes.append(DeclaredPass(stages, lambda frame: frame.run(dispatches), access.id, found))
        return result

    def read_back(self, *buffers: Buffer) -> BufferReadback:
        """Request copies of buffers at the end of the frame; return the readback that gives their content.

        The readback contains the content of all buffers, concatenated in the order of the arguments.
        """
        readback = BufferReadback(self.device, sum(buffer.size for buffer in buffers))
        self._readbacks.append((buffers, readback))
        return readback

    def submit(self, timed: Timing = False) -> CommandList:
        """Run the stale passes and return their command list, from which stage times can be read.

        timed : True to time each stage, "whole" to time only the frame, False for no timing
        """
        frame = CommandList(self.device, timed=timed, uniforms=self._uniforms)
        try:
            dependencies = self._find_dependencies()
            versions = dependencies.compute_versions(self._epoch, [one.key for one in self._passes])
            is_stale = dependencies.find_stale_passes(versions)
            stale = [one for one, now in zip(self._passes, is_stale, strict=True) if now]
            if self.listing is not None:
                self.listing.mark_passes_that_ran(is_stale)
                self.listing = None
            for one in stale:
                one.run(frame)
            for buffers, readback in self._readbacks:
                frame.read_back(buffers, readback)
            frame.submit()
        except Exception:
            self.invalidate()
            raise
        finally:
            self._passes, self._readbacks = [], []  # they keep resources alive
        dependencies.set_versions(is_stale, versions)
        self.executed_stages = [stage for one in stale for stage in one.stages]
        return frame

    def _find_dependencies(self) -> Dependencies:
        """Return the dependencies of the declared passes, cached for frames with the same passes."""
        passes = [one.access for one in self._passes]
        for known in self._dependencies:
            if known.passes == passes:
                return known
        self._dependencies = [Dependencies(passes), *self._dependencies][:_MAX_CACHED_DEPENDENCIES]
        return self._dependencies[0]

    def _declare_pass(
        self,
        stage: str,
        program: Program,
        resources: Bindings,
        workgroups: tuple[int, ...],
        access: Access,
        writes: tuple[ResourceState, ...],
        run: Callable[[CommandList], None],
        further_key_parts: tuple[Hashable, ...] = (),
    ) -> None:
        if self.listing is not None:
            self.listing.add(stage, program, resources, workgroups, len(self._passes))
        key = access.id, workgroups, further_key_parts, program.used_uniform_bytes(resources, self._uniforms)
        self._passes.append(DeclaredPass((stage,), run, key, (access.id, access.reads, writes)))
