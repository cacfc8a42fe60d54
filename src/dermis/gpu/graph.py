"""The frame graph: stages declare passes in order, only stale passes run, and a frame can be listed."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from typing import TypeVar, TypeVarTuple

import numpy as np

from dermis.gpu.command_list import CommandList, Timing
from dermis.gpu.dependencies import Access, Declared, Dependencies, Slot, resource_state
from dermis.gpu.device import Device
from dermis.gpu.program import ComputeProgram, FragmentProgram, Program, RasterProgram
from dermis.gpu.readback import BufferReadback
from dermis.gpu.recorder import DrawTarget, Groups, Recorder
from dermis.gpu.replay import Recordings
from dermis.gpu.types import Bindable, Bindings, Buffer, TextureOrView, is_buffer, is_texture, is_view
from dermis.gpu.uniforms import Uniforms

T = TypeVar("T")
Ts = TypeVarTuple("Ts")
_MOST_KNOWN = 8  # kinds of frames in turn: pictures, their readback, and those of several views


@dataclass
class ListedPass:
    """One pass.

    shader : name of its file
    constants : pipeline constants
    bindings : by name in the shader: number of a resource, "sampler", or "record 128" with its bytes
    groups : workgroups, or vertices of a raster pass
    recorded : whether it is part of a recording, whose records do not change
    ran : whether it ran in that frame
    """

    stage: str
    shader: str
    constants: dict[str, float]
    bindings: dict[str, int | str]
    groups: tuple[int, ...]
    recorded: bool = False
    ran: bool = False


@dataclass
class Listing:
    """Passes in order, and the resources that they bind.

    resources : each described: "rgba32float 512 x 512 x 7", "buffer 4096"
    """

    passes: list[ListedPass] = field(default_factory=list)
    resources: list[str] = field(default_factory=list)
    _numbers: dict[int, int] = field(default_factory=dict)
    _indices: list[int] = field(default_factory=list)

    def add(
        self,
        stage: str,
        program: Program,
        resources: Bindings,
        groups: Sequence[int],
        index: int,
        recorded: bool = False,
    ) -> None:
        """Add a pass.

        index : of the graph's pass that it belongs to
        """
        bindings = {one.name: self._bound(resources[one.name]) for one in program.bindings}
        listed = ListedPass(stage, program.name, dict(program.constants), bindings, tuple(groups), recorded)
        self.passes.append(listed)
        self._indices.append(index)

    def add_write(self, stage: str, buffer: Buffer, size: int, index: int) -> None:
        """Write down that the host puts `size` bytes into a buffer."""
        self.passes.append(ListedPass(stage, "from the host", {}, {"written": self._bound(buffer)}, (size,)))
        self._indices.append(index)

    def finish(self, ran: Sequence[bool]) -> None:
        """Note which of the graph's passes ran."""
        for one, index in zip(self.passes, self._indices, strict=True):
            one.ran = ran[index]

    def as_dict(self) -> dict[str, object]:
        """The listing as plain data for JSON."""
        return {"resources": self.resources, "passes": [asdict(one) for one in self.passes]}

    def lines(self) -> Iterator[str]:
        """A line for each pass."""
        for one in self.passes:
            bound = " ".join(f"{name}={value}" for name, value in one.bindings.items())
            mark = "ran " if one.ran else "kept"
            yield f"{mark} {one.stage}: {one.shader} {'x'.join(map(str, one.groups))} {bound}"

    def _bound(self, value: Bindable) -> int | str:
        if isinstance(value, np.ndarray):
            return f"record {value.nbytes}"
        described = _described(value)
        if described == "sampler":
            return described
        if id(value) not in self._numbers:
            self._numbers[id(value)] = len(self.resources)
            self.resources.append(described)
        return self._numbers[id(value)]


class ListingRecorder(Recorder):
    """Lists the passes of a recording.

    index : of the recording among the graph's passes
    """

    def __init__(self, device: Device, listing: Listing, index: int) -> None:
        self.device, self._listing, self._index = device, listing, index

    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Bindings, groups: Groups, completes: str = ""
    ) -> None:
        """Add a pass with its number of workgroups along each axis."""
        self._listing.add(stage, program, resources, groups, self._index, recorded=True)


def _described(value: Bindable) -> str:
    if is_view(value):
        return f"view of {_described(value.texture)}"
    if is_texture(value):
        width, height, layers = value.size
        return f"{value.format} {width} x {height} x {layers}"
    return f"buffer {value.size}" if is_buffer(value) else "sampler"


@dataclass(slots=True)
class DeclaredPass:
    """One pass of a frame, or a recorded run of them.

    run : does it
    key : what its result follows from besides the content that it reads
    """

    stages: tuple[str, ...]
    run: Callable[[CommandList], None]
    key: Hashable
    declared: Declared


class Graph(Recorder):
    """Declares the passes of each frame with the methods of `CommandList`, and runs those that are stale.

    A pass' reads and writes come from its shader's bindings. The version that it writes follows from its
    program, its resources and their versions, the workgroups, and the constants that the shader reads. A pass
    is skipped while its outputs hold that version, and also when no pass that runs needs them.

    ran : stages of the passes that the last frame ran, in order
    listing : when it is set, the passes of the next frame are written down there
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self.recordings = Recordings()
        self.ran: list[str] = []
        self.listing: Listing | None = None
        self._epoch = 0
        self._passes: list[DeclaredPass] = []
        self._uniforms = Uniforms(device)
        self._known: list[Dependencies] = []
        self._fetches: list[tuple[tuple[Buffer, ...], BufferReadback]] = []

    def forget(self) -> None:
        """Take all content for unknown: the next frame runs every pass."""
        self._epoch += 1

    def begin(self) -> None:
        """Begin a frame."""
        self._passes.clear()
        self._uniforms.clear()
        self._fetches.clear()

    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Bindings, groups: Groups, completes: str = ""
    ) -> None:
        """Declare a compute pass, see `Recorder.dispatch`."""
        access = program.access(resources)
        writes = access.writes
        if completes:
            filled = resource_state(self.device, resources[completes])
            writes = tuple(slot for slot in writes if slot is not filled)

        def run(frame: CommandList) -> None:
            frame.dispatch(stage, program, resources, groups, access=access)

        self._add(stage, program, resources, groups, access, writes, run)

    def write(self, stage: str, buffer: Buffer, data: bytes) -> None:
        """Declare what the host writes, see `Recorder.write`."""
        slot = resource_state(self.device, buffer)

        def run(frame: CommandList) -> None:
            frame.write(stage, buffer, data)

        if self.listing is not None:
            self.listing.add_write(stage, buffer, len(data), len(self._passes))
        self._passes.append(DeclaredPass((stage,), run, data, (0, (), (slot,))))

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
        """Declare a pass that rasterises, see `Recorder.draw`."""
        attached = (target.depth, target.colour)
        writes = tuple(resource_state(self.device, one) for one in attached if one is not None)

        def run(commands: CommandList) -> None:
            commands.draw(stage, program, resources, vertices, target, indices=indices, layer=layer)

        access = program.access(resources)
        taken = None if indices is None else resource_state(self.device, indices)
        self._add(stage, program, resources, (vertices,), access, writes, run, (layer, target.far, taken))

    def fill(
        self, stage: str, program: FragmentProgram, resources: Bindings, targets: Sequence[TextureOrView]
    ) -> None:
        """Declare a pass that fills targets, see `Recorder.fill`."""
        writes = tuple(resource_state(self.device, one) for one in targets)

        def run(frame: CommandList) -> None:
            frame.fill(stage, program, resources, targets)

        self._add(stage, program, resources, (3,), program.access(resources), writes, run)

    def repeat(self, record: Callable[[Recorder, *Ts], T], *args: *Ts) -> T:
        """Declare the passes that `record(graph, *args)` declares, recorded once for the same arguments.

        Compute passes only. The recording runs as a whole or not at all, and takes Python next to no time.
        """
        recording, result = self.recordings.find(self.device, record, args)
        if self.listing is not None:
            record(ListingRecorder(self.device, self.listing, len(self._passes)), *args)
        access, steps = recording.access, recording.steps
        declared = access.number, access.reads, access.writes
        self._passes.append(
            DeclaredPass(recording.stages, lambda frame: frame.run(steps), access.number, declared)
        )
        return result

    def fetch(self, *buffers: Buffer) -> BufferReadback:
        """The bytes of buffers, one after the other, as all the frame's passes leave them."""
        fetched = BufferReadback(self.device, sum(buffer.size for buffer in buffers))
        self._fetches.append((buffers, fetched))
        return fetched

    def submit(self, timed: Timing = False) -> CommandList:
        """Run what has to be run; returns the frame, which knows how long it took."""
        frame = CommandList(self.device, timed=timed, uniforms=self._uniforms)
        try:
            needed = self._dependencies()
            versions = needed.versions(self._epoch, [one.key for one in self._passes])
            runs = needed.due(versions)
            due = [one for one, now in zip(self._passes, runs, strict=True) if now]
            if self.listing is not None:
                self.listing.finish(runs)
                self.listing = None
            for one in due:
                one.run(frame)
            for buffers, fetched in self._fetches:
                frame.fetch(buffers, fetched)
            frame.submit()
        except Exception:
            self.forget()
            raise
        finally:
            self._passes, self._fetches = [], []  # which keep resources alive
        needed.ran(runs, versions)
        self.ran = [stage for one in due for stage in one.stages]
        return frame

    def _dependencies(self) -> Dependencies:
        """Of the passes that are declared."""
        declared = [one.declared for one in self._passes]
        for known in self._known:
            if known.declared == declared:
                return known
        self._known = [Dependencies(declared), *self._known][:_MOST_KNOWN]
        return self._known[0]

    def _add(
        self,
        stage: str,
        program: Program,
        resources: Bindings,
        size: tuple[int, ...],
        access: Access,
        writes: tuple[Slot, ...],
        run: Callable[[CommandList], None],
        more: tuple[Hashable, ...] = (),
    ) -> None:
        if self.listing is not None:
            self.listing.add(stage, program, resources, size, len(self._passes))
        key = access.number, size, more, program.numbers(resources, self._uniforms)
        self._passes.append(DeclaredPass((stage,), run, key, (access.number, access.reads, writes)))
