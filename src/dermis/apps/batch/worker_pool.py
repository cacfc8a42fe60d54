"""Worker processes on this machine: a slot for each, a shard at a time, replaced when they die."""

from __future__ import annotations

import os
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import connection

from dermis.apps.batch.child_processes import ChildProcess, start
from dermis.apps.batch.shards import Shard
from dermis.apps.batch.worker import RunOptions, WorkerEvent, WorkerSlot, serve
from dermis.base.errors import DermisError
from dermis.gpu.adapters import Adapter, similar_adapters

MAX_ATTEMPTS = 3
"""Attempts at a shard before it is given up."""
_MAX_ENCODERS = 8  # of a worker: more wait for what it renders


@dataclass(frozen=True)
class SlotRequest:
    """Requested workers; None where the machine decides.

    adapter : "auto", "cpu", part of a name: all that are alike are used; or one by its number, as "#1"
    numbers : of adapters, in place of `adapter`
    workers : in all
    workers_per_gpu : of each adapter, where `workers` is None
    encoders : of each worker
    """

    adapter: str = "auto"
    numbers: tuple[int, ...] = ()
    workers: int | None = None
    workers_per_gpu: int = 1
    encoders: int | None = None

    def adapters(self) -> list[Adapter]:
        """Return the adapters to use.

        Raises DermisError when one of them is not there.
        """
        if not self.numbers:
            return similar_adapters(self.adapter)
        return [similar_adapters(f"#{number}")[0] for number in self.numbers]

    def slots(self) -> tuple[list[WorkerSlot], int]:
        """Return a slot for each worker, in turn on each adapter, and the number of encoders of each.

        A software adapter shares the cores with Python and the encoders: there is a worker for each two
        cores, with as many threads, and it encodes by itself.
        """
        adapters, cores = self.adapters(), available_cores()
        software = adapters[0].kind == "CPU"
        usual = max(1, cores // 2) if software else len(adapters) * self.workers_per_gpu
        workers = self.workers or usual
        threads = max(1, cores // workers) if software else 0
        encoders = 0 if software else min(_MAX_ENCODERS, max(1, cores // workers - 1))
        slots = [WorkerSlot(f"#{adapters[k % len(adapters)].number}", threads) for k in range(workers)]
        return slots, encoders if self.encoders is None else self.encoders


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True)
class ProcessPool:
    """Crew of worker processes, one for each slot."""

    slots: Sequence[WorkerSlot]

    def render(self, work: RunOptions, shards: Sequence[Shard]) -> Iterator[WorkerEvent]:
        """Render the shards and yield events as they happen.

        Raises DermisError for what no worker can mend, with all of them ended.
        """
        pool = _Pool(work, shards)
        try:
            for slot in self.slots:
                pool.employ(slot)
            while pool.workers:
                by_pipe = {worker.child.pipe: worker for worker in pool.workers}
                for pipe in connection.wait(list(by_pipe)):
                    yield pool.receive(by_pipe[pipe])  # type: ignore[index]
        finally:
            for worker in pool.workers:
                worker.child.end()


@dataclass
class _Process:
    """Worker process in its slot, and the shard that it renders."""

    slot: WorkerSlot
    child: ChildProcess
    shard: Shard


class _Pool:
    """State of a run: the worker processes, and the shards that wait for one."""

    def __init__(self, work: RunOptions, shards: Sequence[Shard]) -> None:
        self._work, self._waiting, self._begun = work, deque(shards), Counter[int]()
        self.workers: list[_Process] = []

    def employ(self, slot: WorkerSlot) -> None:
        """Start a worker, if there is a shard for it."""
        if self._waiting:
            worker = _Process(slot, start(serve, slot, self._work), self._waiting.popleft())
            self.workers.append(worker)
            self._give(worker)

    def receive(self, worker: _Process) -> WorkerEvent:
        """Return the next event of a worker, and give it the next shard or replace it.

        Raises DermisError for a refusal, and for a shard that too many workers failed at.
        """
        try:
            event: WorkerEvent = worker.child.pipe.recv()
        except (EOFError, OSError):
            event = WorkerEvent(retry=f"a worker: {worker.child.fate()}")
        if event.refusal:
            raise DermisError(event.refusal)
        if event.retry:
            self._dismiss(worker)
            if self._begun[worker.shard.index] >= MAX_ATTEMPTS:
                expected = f"shard {worker.shard.index}: expected a worker to draw it"
                raise DermisError(
                    f"{expected}, but {MAX_ATTEMPTS} failed, the last one so: {event.retry}. "
                    "What is whole is kept; give the command again to go on."
                )
            self._waiting.appendleft(worker.shard)
            self.employ(worker.slot)
        elif event.shard is not None and self._waiting:
            worker.shard = self._waiting.popleft()
            self._give(worker)
        elif event.shard is not None:
            self._dismiss(worker)
        return event

    def _give(self, worker: _Process) -> None:
        self._begun[worker.shard.index] += 1
        with suppress(OSError):  # it died, which its end of the pipe reports next
            worker.child.pipe.send(worker.shard)

    def _dismiss(self, worker: _Process) -> None:
        self.workers.remove(worker)
        worker.child.end()
