"""The frame graph: stages declare passes in order, and only stale passes run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from dermis.gpu.access import Access, Slot, slot_of
from dermis.gpu.device import Device
from dermis.gpu.frame import Frame, Timed
from dermis.gpu.listing import Lister, Listing
from dermis.gpu.program import ComputeProgram, Program, Resources
from dermis.gpu.raster_program import FragmentProgram, RasterProgram
from dermis.gpu.readback import Fetched
from dermis.gpu.recorder import Recorder
from dermis.gpu.recording import Recordings

T = TypeVar("T")
Groups = tuple[int, int, int]


@dataclass(slots=True)
class Pass:
    """One pass of a frame, or a recorded run of them.

    run : does it
    writes : what it leaves in which slots
    needs : passes before it, and the slots in which they leave what it reads
    """

    stages: tuple[str, ...]
    run: Callable[[Frame], None]
    writes: list[tuple[Slot, int]]
    needs: list[tuple[int, Slot]] = field(default_factory=list)


class Graph(Recorder):
    """Declares the passes of each frame with the methods of `Frame`, and runs those that are stale.

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
        self._frame = 0
        self._passes: list[Pass] = []
        self._hashes: dict[int, int] = {}  # of this frame's records, which its passes keep alive
        self._fetches: list[tuple[Any, Fetched]] = []

    def forget(self) -> None:
        """Take all content for unknown: the next frame runs every pass."""
        self._epoch += 1

    def begin(self) -> None:
        """Begin a frame."""
        self._frame = self.device.next_frame()
        self._passes.clear()
        self._hashes.clear()
        self._fetches.clear()

    def dispatch(
        self, stage: str, program: ComputeProgram, resources: Resources, groups: Groups, completes: str = ""
    ) -> None:
        """Declare a pass of a number of workgroups along each axis; see `Recorder.dispatch`."""
        access = program.access(resources)
        writes: Sequence[Slot] = access.writes
        if completes:
            filled = slot_of(self.device, resources[completes])
            writes = [slot for slot in writes if slot is not filled]

        def run(frame: Frame) -> None:
            frame.dispatch(stage, program, resources, groups, access=access)

        self._list(stage, program, resources, groups)
        key = (access.number, groups, program.numbers(resources, self._hashes))
        self._add((stage,), key, access, writes, run)

    def write(self, stage: str, buffer: Any, data: bytes) -> None:
        """Declare that the host puts bytes into the start of a buffer, before all passes.

        data : the same object in each frame costs nothing, as Python keeps the hash of bytes
        """
        slot = slot_of(self.device, buffer)

        def run(frame: Frame) -> None:
            frame.write(stage, buffer, data)

        if self.listing is not None:
            self.listing.add_write(stage, buffer, len(data), len(self._passes))
        self._add((stage,), (data,), Access(0, (), (slot,)), [slot], run)

    def draw(
        self,
        stage: str,
        program: RasterProgram,
        resources: Resources,
        vertices: int,
        *,
        layer: int = 0,
        depth: Any,
        far: float,
        target: Any = None,
    ) -> None:
        """Declare a pass that rasterises triangles into cleared targets, as `Frame.draw` does."""
        access, options = program.access(resources), {"layer": layer, "depth": depth, "far": far}
        writes = [slot_of(self.device, one) for one in (depth, target) if one is not None]
        key = (access.number, vertices, layer, far, program.numbers(resources, self._hashes))

        def run(frame: Frame) -> None:
            frame.draw(stage, program, resources, vertices, target=target, **options)

        self._list(stage, program, resources, (vertices,))
        self._add((stage,), key, access, writes, run)

    def fill(
        self, stage: str, program: FragmentProgram, resources: Resources, targets: Sequence[Any]
    ) -> None:
        """Declare a pass for each texel of its targets, as `Frame.fill` does."""
        access = program.access(resources)
        writes = [slot_of(self.device, one) for one in targets]
        key = (access.number, program.numbers(resources, self._hashes))
        self._list(stage, program, resources, (3,))
        self._add(
            (stage,),
            key,
            access,
            writes,
            lambda frame: frame.fill(stage, program, resources, targets),
        )

    def repeat(self, record: Callable[..., T], *args: Any) -> T:
        """Declare the passes that `record(graph, *args)` declares, recorded once for the same arguments.

        Compute passes only. The recording runs as a whole or not at all, and takes Python next to no time.
        """
        recording, result = self.recordings.find(self.device, record, args)
        steps = recording.steps
        if self.listing is not None:
            record(Lister(self.device, self.listing, len(self._passes)), *args)
        access = recording.access
        self._add(recording.stages, (access.number,), access, access.writes, lambda frame: frame.run(steps))
        return result

    def fetch(self, buffer: Any) -> Fetched:
        """The bytes of a buffer as all the frame's passes leave it, on their way from the device."""
        fetched = Fetched(self.device, buffer.size)
        self._fetches.append((buffer, fetched))
        return fetched

    def submit(self, timed: Timed = False) -> Frame:
        """Run what has to be run; returns the frame, which knows how long it took."""
        frame = Frame(self.device, timed=timed)
        try:
            runs = self._due()
            due = [one for one, now in zip(self._passes, runs, strict=True) if now]
            if self.listing is not None:
                self.listing.finish(runs)
                self.listing = None
            for one in due:
                one.run(frame)
            for buffer, fetched in self._fetches:
                frame.fetch(buffer, fetched)
            frame.submit()
        except Exception:
            self.forget()
            raise
        finally:
            self._passes, self._fetches = [], []  # which keep resources alive
        for one in due:
            for slot, value in one.writes:
                slot.hold(value)
        self.ran = [stage for one in due for stage in one.stages]
        return frame

    def _list(self, stage: str, program: Program, resources: Resources, groups: Sequence[int]) -> None:
        if self.listing is not None:
            self.listing.add(stage, program, resources, groups, len(self._passes))

    def _add(
        self,
        stages: tuple[str, ...],
        key: tuple[Any, ...],
        access: Access,
        writes: Sequence[Slot],
        run: Any,
    ) -> None:
        now, index = self._frame, len(self._passes)
        needs, found = list[tuple[int, Slot]](), list[int]()
        for slot in access.changing(self.device.active_slots):
            sources = slot.sources(now)
            for source in sources:
                found.append(source.value)
                needs.append((source.writer, source))
            if not sources and slot not in writes:
                found.append(slot.held or (slot.parent.held if slot.parent else 0))
        made = hash((self._epoch, key, *found))
        left = [(slot, made + number) for number, slot in enumerate(writes, start=1)]
        for slot, value in left:
            if not slot.active:
                slot.active = True
                self.device.active_slots += 1
            slot.write(now, index, value)
        self._passes.append(Pass(stages, run, left, needs))

    def _due(self) -> list[bool]:
        """Which passes have to run for every resource to hold what all of them together leave."""
        lost: set[int] = set()  # slots that hold what is wanted, and will not any more
        while True:
            due = self._due_without(lost)
            if all(due):
                return due
            spoilt = {
                id(slot)
                for index, one in enumerate(self._passes)
                if due[index]
                for slot, _ in one.writes
                if not due[slot.writers[-1]]
            }
            if spoilt <= lost:
                return due
            lost |= spoilt

    def _due_without(self, lost: set[int]) -> list[bool]:
        due, wanted = [False] * len(self._passes), set[tuple[int, int]]()
        for index in range(len(self._passes) - 1, -1, -1):
            one = self._passes[index]
            for slot, value in one.writes:
                last = slot.writers[-1] == index
                there = last and slot.held == value and id(slot) not in lost
                if not there and ((last and not slot.scratch) or (index, id(slot)) in wanted):
                    due[index] = True
            if due[index]:
                wanted.update((before, id(slot)) for before, slot in one.needs)
        return due
