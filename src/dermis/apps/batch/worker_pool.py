"""Worker processes on this machine: each worker renders one part at a time; dead workers are replaced."""

from __future__ import annotations

import os
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import connection

from dermis.apps.batch.child_processes import ChildProcess, start_process
from dermis.apps.batch.shards import Shard
from dermis.apps.batch.worker import RunOptions, WorkerEvent, WorkerSlot, run_worker
from dermis.base.errors import DermisError
from dermis.gpu.adapters import Adapter, adapters_like_best_match

MAX_TASK_ATTEMPTS = 3
"""Attempts to render a part before the run fails."""
_MAX_ENCODERS_PER_WORKER = 8  # per worker: more would wait for the renderer


@dataclass(frozen=True)
class SlotRequest:
    """Requested number of workers, and their graphics adapters; None selects a default for this machine.

    adapter : "auto", "cpu", a number such as "#1", or a part of an adapter's name. If several adapters match,
        the best match is used, together with the other matches of the same device type and graphics API
    numbers : numbers of the adapters to use, in place of `adapter`
    workers : total number of workers
    workers_per_gpu : workers on each adapter, if `workers` is None
    encoders : number of encoder processes per worker
    """

    adapter: str = "auto"
    numbers: tuple[int, ...] = ()
    workers: int | None = None
    workers_per_gpu: int = 1
    encoders: int | None = None

    def matching_adapters(self) -> list[Adapter]:
        """Return the adapters that match the request.

        Raises DermisError if a requested adapter does not exist.
        """
        if not self.numbers:
            return adapters_like_best_match(self.adapter)
        return [adapters_like_best_match(f"#{number}")[0] for number in self.numbers]

    def worker_slots(self) -> tuple[list[WorkerSlot], int]:
        """Return one slot per worker, and the number of encoder processes per worker.

        The adapters are assigned to the workers in turn. On a software adapter, there is by default one
        worker for every two processor cores, and each worker encodes its images itself. The threads of all
        workers together then use all cores.
        """
        adapters, cores = self.matching_adapters(), available_cores()
        software = adapters[0].kind == "CPU"
        default = max(1, cores // 2) if software else len(adapters) * self.workers_per_gpu
        workers = self.workers or default
        threads = max(1, cores // workers) if software else 0
        encoders = 0 if software else min(_MAX_ENCODERS_PER_WORKER, max(1, cores // workers - 1))
        slots = [WorkerSlot(f"#{adapters[k % len(adapters)].number}", threads) for k in range(workers)]
        return slots, encoders if self.encoders is None else self.encoders


def available_cores() -> int:
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True)
class ProcessPool:
    """Pool of worker processes on this machine, one for each `WorkerSlot`."""

    slots: Sequence[WorkerSlot]

    def render(self, options: RunOptions, tasks: Sequence[Shard]) -> Iterator[WorkerEvent]:
        """Process the tasks with one worker per slot, and yield the events of the workers as they arrive.

        Raises DermisError, after stopping all workers, for errors that would recur on another attempt.
        """
        pool = _PoolState(options, tasks, list(self.slots))
        try:
            pool.start_workers()
            while pool.workers:
                by_pipe = {worker.child.pipe: worker for worker in pool.workers}
                for pipe in connection.wait(list(by_pipe)):
                    yield pool.receive(by_pipe[pipe])  # type: ignore[index]
        finally:
            for worker in pool.workers:
                worker.child.kill()


@dataclass
class _WorkerProcess:
    """Worker process, and the tasks that were sent to it.

    slot : graphics adapter and number of threads of this worker
    tasks : the task in progress, and at most one task to do next
    """

    slot: WorkerSlot
    child: ChildProcess
    tasks: list[Shard]


class _PoolState:
    """State of a run on this machine: its worker processes, and the queue of unassigned tasks."""

    def __init__(self, options: RunOptions, tasks: Sequence[Shard], slots: list[WorkerSlot]) -> None:
        self._options, self._queue, self._attempts = options, deque(tasks), Counter[Shard]()
        self._free_slots = slots
        self.workers: list[_WorkerProcess] = []

    def start_workers(self) -> None:
        """Start a worker on each free slot while the queue has tasks."""
        while self._queue and self._free_slots:
            slot = self._free_slots.pop(0)
            worker = _WorkerProcess(slot, start_process(run_worker, slot, self._options), [])
            self.workers.append(worker)
            self._send_task(worker)

    def receive(self, worker: _WorkerProcess) -> WorkerEvent:
        """Return the next event of a worker; then send the worker a task, replace the worker, or stop it.

        Raises DermisError if the event requires the run to end, or if a task failed `MAX_TASK_ATTEMPTS`
        times.
        """
        try:
            event: WorkerEvent = worker.child.pipe.recv()
        except (EOFError, OSError):
            event = WorkerEvent(retry=f"a worker: {worker.child.exit_reason()}")
        if event.refusal:
            raise DermisError(event.refusal)
        if event.done is not None:
            worker.tasks.remove(event.done)
            self._queue.extendleft(reversed(event.missing))
        if event.retry:
            self._requeue_tasks(worker, event.retry)
            self._stop_worker(worker)
        elif self._gets_another_task(worker):
            self._send_task(worker)
        elif not worker.tasks:
            self._stop_worker(worker)
        self.start_workers()
        return event

    def _gets_another_task(self, worker: _WorkerProcess) -> bool:
        """Return whether to send a worker another task.

        A worker without tasks gets one if the queue is not empty. A worker with one task gets a second one if
        the first task never failed before, and if the queue has at least as many tasks as there are workers.
        The second task avoids a pause between tasks.
        """
        if not worker.tasks:
            return bool(self._queue)
        is_first_attempt = self._attempts[worker.tasks[0]] == 1
        return len(worker.tasks) == 1 and is_first_attempt and len(self._queue) >= len(self.workers)

    def _stop_worker(self, worker: _WorkerProcess) -> None:
        self.workers.remove(worker)
        worker.child.kill()
        self._free_slots.append(worker.slot)

    def _requeue_tasks(self, worker: _WorkerProcess, reason: str) -> None:
        """Put the tasks of an exiting worker back into the queue.

        reason : reason why the worker exits, for the error

        Raises DermisError if the task in progress has failed `MAX_TASK_ATTEMPTS` times.
        """
        current, *unstarted = worker.tasks
        if self._attempts[current] >= MAX_TASK_ATTEMPTS:
            raise DermisError(
                f"{current}: expected a worker to render it, but {MAX_TASK_ATTEMPTS} failed; "
                f"the last one reported: {reason}. "
                "Complete parts are kept; run the command again to continue."
            )
        self._attempts.subtract(unstarted)
        self._queue.extendleft(reversed(worker.tasks))

    def _send_task(self, worker: _WorkerProcess) -> None:
        task = self._queue.popleft()
        worker.tasks.append(task)
        self._attempts[task] += 1
        with suppress(OSError):  # the process died, which the next read of the pipe reports
            worker.child.pipe.send(task)
