"""Rendering of parts of shards inside a worker of dask.distributed."""

from __future__ import annotations

import itertools
import os
import socket
import threading
import tomllib
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

from distributed import WorkerPlugin, get_worker

from dermis.apps.batch.child_processes import ChildProcess, LostProcessError, start_process
from dermis.apps.batch.shards import Shard
from dermis.apps.batch.spec import parse_spec
from dermis.apps.batch.worker import RunOptions, WorkerEvent, WorkerSlot, run_worker
from dermis.base.errors import DermisError, DermisWarning
from dermis.base.private import cache_folder, make_private_folder
from dermis.gpu.adapters import adapters_like_best_match

_MALLOC_TRIM_VARIABLE = "MALLOC_TRIM_THRESHOLD_"
"""Environment variable that dask's nannies set, so that workers return freed memory to the system at once.
Large arrays are then slow to allocate."""


@dataclass
class _PluginState:
    """State of a `PartPlugin` in its dask worker.

    child : worker process, started for the first task
    lock : lock that is held while a task is processed
    cleanup : context managers to exit, and callbacks to call, when the process is stopped
    stopped : event that is set when the run has ended and rendering must stop
    """

    child: ChildProcess | None = None
    lock: threading.Lock = field(default_factory=threading.Lock)
    cleanup: ExitStack = field(default_factory=ExitStack)
    stopped: threading.Event = field(default_factory=threading.Event)

    def close(self) -> None:
        self.child = None
        self.cleanup.close()


@dataclass
class PartPlugin(WorkerPlugin):  # type: ignore[misc]
    """Plugin that runs a rendering process beside a dask worker, from the first task to the end of the run.

    The process renders just as it would without dask; the dask worker only waits for it.

    spec_toml : spec as TOML, with the hashes of the files named in the spec
    folder : folder to which file names in the spec are relative
    out : output folder of the run
    encoders : number of encoder processes, as in `RunOptions`
    keep_going : whether to omit images that cannot be rendered, as in `RunOptions`
    adapter : graphics adapters to use, as in `DaskCluster`
    """

    spec_toml: str
    folder: Path
    out: Path
    encoders: int
    keep_going: bool
    adapter: str

    @classmethod
    def from_run_options(cls, options: RunOptions, adapter: str) -> Self:
        """Return the plugin for the options of a run and the requested graphics adapters."""
        folder, out = options.spec.folder.resolve(), options.out.resolve()
        return cls(options.spec.to_toml(), folder, out, options.encoders, options.keep_going, adapter)

    def setup(self, worker: object) -> None:
        """Initialise the state; dask calls this when the plugin is registered with a worker."""
        os.environ.pop(_MALLOC_TRIM_VARIABLE, None)
        self._state = _PluginState()

    def teardown(self, worker: object) -> None:
        """Stop rendering and release the process; dask calls this at the end of the run or of the worker."""
        self._state.stopped.set()
        if self._state.lock.acquire(blocking=False):
            self._state.close()
            self._state.lock.release()

    def run_task(self, task: Shard) -> WorkerEvent:
        """Process a task as `Worker.run_tasks` does; return an event that reports its completion or an error.

        Raises LostProcessError if the process or its device was lost; dask then retries the task.
        """
        state = self._state
        with state.lock:
            try:
                return self._run_in_child(state.child or self._start_child(), task)
            except LostProcessError:
                state.close()
                raise
            except DermisError as fault:
                return WorkerEvent(refusal=str(fault))
            finally:
                if state.stopped.is_set():
                    state.close()

    def _run_in_child(self, child: ChildProcess, task: Shard) -> WorkerEvent:
        try:
            child.pipe.send(task)
            while not self._state.stopped.is_set():
                event: WorkerEvent = child.pipe.recv()
                if event.retry:
                    raise LostProcessError(event.retry)
                if event.note:
                    warnings.warn(event.note, DermisWarning, stacklevel=2)
                if event.refusal:
                    self._state.close()
                    return event
                if event.done is not None:
                    return replace(event, images=event.rendered)
        except (EOFError, OSError) as fault:
            raise LostProcessError(f"a worker: {child.exit_reason()}") from fault
        return WorkerEvent(refusal="the run: expected to continue, but it has ended. Run the command again.")

    def _start_child(self) -> ChildProcess:
        """Start the rendering process, on an adapter chosen by the rank of this dask worker on its host."""
        cleanup = self._state.cleanup
        rank = cleanup.enter_context(reserve_local_rank())
        adapters = adapters_like_best_match(self.adapter)
        spec = parse_spec(tomllib.loads(self.spec_toml), self.folder)
        slot = WorkerSlot(f"#{adapters[rank % len(adapters)].number}")
        child = start_process(run_worker, slot, RunOptions(spec, self.out, self.encoders, self.keep_going))
        cleanup.callback(child.kill)
        self._state.child = child
        return child


def run_task(plugin_name: str, task: Shard) -> WorkerEvent:
    """Process a task inside a dask worker, with the `PartPlugin` that is registered with this worker.

    plugin_name : name under which the plugin is registered
    task : part of a shard to render, or complete shard to verify
    """
    event: WorkerEvent = get_worker().plugins[plugin_name].run_task(task)
    return event


def path_exists(file_path: str) -> bool:
    """Return whether a file exists on the worker's disk."""
    return Path(file_path).exists()


@contextmanager
def reserve_local_rank() -> Iterator[int]:
    """Yield the smallest rank, counted from 0, that no other process of this user holds on this host.

    Dask workers on one host choose different adapters by rank. A process holds a rank by locking a file; the
    system releases the lock when the process exits. Where file locks are not available, the rank is 0.
    """
    folder = cache_folder() / "ranks"
    try:
        import fcntl

        make_private_folder(folder)
    except (ImportError, OSError):
        yield 0
        return
    for rank in itertools.count():
        lock_file = folder / f"{socket.gethostname()}-{rank}.lock"
        descriptor = os.open(lock_file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(descriptor)
            continue
        try:
            yield rank
        finally:
            os.close(descriptor)
        return
