"""Worker processes on this machine: a slot for each, a shard at a time, replaced when they die."""

from __future__ import annotations

import os
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import connection
from typing import Any

from dermis.apps.batch.child_processes import Child, LostProcessError, start
from dermis.apps.batch.shards import Shard
from dermis.apps.batch.worker import Work, Worker, WorkerEvent
from dermis.base.errors import DermisError, DermisWarning
from dermis.gpu.adapters import Adapter, alike_adapters
from dermis.gpu.failures import DeviceError

MOST_ATTEMPTS = 3
"""How often a shard is begun before it is given up."""


@dataclass(frozen=True)
class WorkerSlot:
    """Where a worker draws.

    adapter : as of `Renderer`
    threads : of a software adapter; 0 leaves it to that
    """

    adapter: str
    threads: int = 0


@dataclass
class _Member:
    """A process at its seat, and the shard that it draws."""

    seat: WorkerSlot
    child: Child
    shard: Shard


@dataclass(frozen=True)
class Processes:
    """A crew of worker processes, one at each seat."""

    seats: Sequence[WorkerSlot]

    def draw(self, work: Work, shards: Sequence[Shard]) -> Iterator[WorkerEvent]:
        """Draw the shards; what happens is told as it does.

        Raises DermisError for what no worker can mend, with all of them ended.
        """
        with _Crew(work, shards) as crew:
            yield from crew.run(self.seats)


class _Crew:
    """Who draws what at the moment."""

    def __init__(self, work: Work, shards: Sequence[Shard]) -> None:
        self._work, self._waiting = work, deque(shards)
        self._members: list[_Member] = []
        self._begun = Counter[int]()

    def __enter__(self) -> _Crew:
        return self

    def __exit__(self, *_: object) -> None:
        for member in self._members:
            member.child.end()

    def run(self, seats: Sequence[WorkerSlot]) -> Iterator[WorkerEvent]:
        for seat in seats:
            self._employ(seat)
        while self._members:
            by_pipe = {member.child.pipe: member for member in self._members}
            for pipe in connection.wait(list(by_pipe)):
                yield self._hear(by_pipe[pipe])

    def _employ(self, seat: WorkerSlot) -> None:
        """Start a worker, if there is a shard for it."""
        if self._waiting:
            member = _Member(seat, start(serve, seat, self._work), self._waiting.popleft())
            self._members.append(member)
            self._give(member)

    def _give(self, member: _Member) -> None:
        self._begun[member.shard.index] += 1
        try:
            member.child.pipe.send(member.shard)
        except OSError:
            return  # it died, which its end of the pipe tells next

    def _hear(self, member: _Member) -> WorkerEvent:
        try:
            told: WorkerEvent = member.child.pipe.recv()
        except (EOFError, OSError):
            told = WorkerEvent(again=f"a worker: {member.child.fate()}")
        if told.refusal:
            raise DermisError(told.refusal)
        if told.again:
            self._replace(member, told.again)
        elif told.shard is not None:
            self._next(member)
        return told

    def _next(self, member: _Member) -> None:
        if self._waiting:
            member.shard = self._waiting.popleft()
            self._give(member)
        else:
            self._dismiss(member)

    def _replace(self, member: _Member, why: str) -> None:
        """Another worker in its place, and its shard to be drawn again."""
        self._dismiss(member)
        if self._begun[member.shard.index] >= MOST_ATTEMPTS:
            raise DermisError(
                f"shard {member.shard.index}: expected a worker to draw it, but {MOST_ATTEMPTS} failed, the "
                f"last one so: {why}. What is whole is kept; give the command again to go on."
            )
        self._waiting.appendleft(member.shard)
        self._employ(member.seat)

    def _dismiss(self, member: _Member) -> None:
        self._members.remove(member)
        member.child.end()


def serve(pipe: Any, seat: WorkerSlot, work: Work) -> None:
    """What a worker process does: draw the shards that come, and tell."""
    if seat.threads:
        os.environ["LP_NUM_THREADS"] = str(seat.threads)  # before its driver is loaded
    with warnings.catch_warnings():
        _tell_notes(lambda text: pipe.send(WorkerEvent(note=text)))
        try:
            with Worker(seat.adapter, work) as worker:
                while True:
                    shard = pipe.recv()
                    failed = worker.draw(shard, lambda: pipe.send(WorkerEvent(images=1)))
                    pipe.send(WorkerEvent(shard=shard, failed=failed))
        except (DeviceError, LostProcessError) as fault:
            pipe.send(WorkerEvent(again=str(fault).removesuffix(".")))  # what is told goes on
        except DermisError as fault:
            pipe.send(WorkerEvent(refusal=str(fault)))


def _tell_notes(tell: Callable[[str], None]) -> None:
    """Let the package's warnings go where the others of the crew hear them."""
    usual = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *more: Any, **named: Any) -> None:
        if issubclass(category, DermisWarning):
            tell(str(message))
        else:
            usual(message, category, *more, **named)

    warnings.simplefilter("default", DermisWarning)
    warnings.showwarning = show


_MOST_ENCODERS = 8  # of a worker: more wait for what it draws


@dataclass(frozen=True)
class SlotRequest:
    """What was asked for; None where the machine decides.

    adapter : "auto", "cpu", part of a name: all that are alike are used; or one by its number, as "#1"
    numbers : of adapters, in their place
    workers : in all
    workers_per_gpu : of each adapter, where `workers` says nothing
    encoders : of each worker
    """

    adapter: str = "auto"
    numbers: tuple[int, ...] = ()
    workers: int | None = None
    workers_per_gpu: int = 1
    encoders: int | None = None

    def adapters(self) -> list[Adapter]:
        """Those that are used.

        Raises DermisError when one of them is not there.
        """
        if not self.numbers:
            return alike_adapters(self.adapter)
        return [alike_adapters(f"#{number}")[0] for number in self.numbers]

    def seats(self) -> tuple[list[WorkerSlot], int]:
        """A seat for each worker, in turn on each adapter; and the number of encoders of each.

        A software adapter shares the cores with Python and the encoders: there is a worker for each two
        cores, with as many threads, and it encodes by itself.
        """
        adapters, cores = self.adapters(), available_cores()
        return _laid_out(adapters, cores, self)


def available_cores() -> int:
    """That this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _laid_out(adapters: Sequence[Adapter], cores: int, asked: SlotRequest) -> tuple[list[WorkerSlot], int]:
    software = adapters[0].kind == "CPU"
    usual = max(1, cores // 2) if software else len(adapters) * asked.workers_per_gpu
    workers = asked.workers or usual
    threads = max(1, cores // workers) if software else 0
    encoders = 0 if software else min(_MOST_ENCODERS, max(1, cores // workers - 1))
    if asked.encoders is not None:
        encoders = asked.encoders
    seats = [WorkerSlot(f"#{adapters[turn % len(adapters)].number}", threads) for turn in range(workers)]
    return seats, encoders
