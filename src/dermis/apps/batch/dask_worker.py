"""Code that runs inside a worker of dask.distributed."""

from __future__ import annotations

import itertools
import os
import socket
import threading
import tomllib
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from distributed import WorkerPlugin, get_worker

from dermis.apps.batch.child_processes import ChildProcess, LostProcessError, start
from dermis.apps.batch.shards import Shard
from dermis.apps.batch.spec import parse_spec
from dermis.apps.batch.worker import RunOptions, WorkerEvent, WorkerSlot, serve
from dermis.base.errors import DermisError, DermisWarning
from dermis.base.private import cache_folder, make_private
from dermis.gpu.adapters import similar_adapters

_TRIM = "MALLOC_TRIM_THRESHOLD_"
"""Set by dask's nannies so that memory is returned at once: large arrays would fault in each time."""


@dataclass
class _State:
    """State of a plugin in its worker.

    child : worker process, started for the first shard
    ends : what is released with it
    over : the run has ended, so that rendering stops
    """

    child: ChildProcess | None = None
    lock: threading.Lock = field(default_factory=threading.Lock)
    ends: ExitStack = field(default_factory=ExitStack)
    over: threading.Event = field(default_factory=threading.Event)

    def close(self) -> None:
        self.child = None
        self.ends.close()


@dataclass
class ShardPlugin(WorkerPlugin):  # type: ignore[misc]
    """Plugin that keeps a worker process beside a worker of dask, from its first shard to the end of the run.

    The process renders as it does without dask, whose own worker only waits for it.

    text, folder : of the spec; the files that it names are known by their hashes, which are in the text
    out, encoders, keep_going : of `RunOptions`
    adapter : as of `Cluster`
    """

    text: str
    folder: Path
    out: Path
    encoders: int
    keep_going: bool
    adapter: str

    @classmethod
    def of(cls, work: RunOptions, adapter: str) -> Self:
        """Return the plugin of a run."""
        folder, out = work.spec.folder.resolve(), work.out.resolve()
        return cls(work.spec.text(), folder, out, work.encoders, work.keep_going, adapter)

    def setup(self, worker: object) -> None:
        """Called by dask when the worker has the plugin."""
        os.environ.pop(_TRIM, None)
        self._state = _State()

    def teardown(self, worker: object) -> None:
        """Called by dask when the run is over or the worker ends; rendering in progress stops by itself."""
        self._state.over.set()
        if self._state.lock.acquire(blocking=False):
            self._state.close()
            self._state.lock.release()

    def render(self, shard: Shard) -> WorkerEvent:
        """Render a shard and return its completion or refusal.

        Raises LostProcessError where the process or its device was lost, after which dask tries again.
        """
        state = self._state
        with state.lock:
            try:
                return self._rendered(state.child or self._start(), shard)
            except LostProcessError:
                state.close()
                raise
            except DermisError as fault:
                return WorkerEvent(refusal=str(fault))
            finally:
                if state.over.is_set():
                    state.close()

    def _rendered(self, child: ChildProcess, shard: Shard) -> WorkerEvent:
        try:
            child.pipe.send(shard)
            while not self._state.over.is_set():
                event: WorkerEvent = child.pipe.recv()
                if event.retry:
                    raise LostProcessError(event.retry)
                if event.note:
                    warnings.warn(event.note, DermisWarning, stacklevel=2)
                if event.refusal:
                    self._state.close()
                    return event
                if event.shard is not None:
                    return WorkerEvent(shard.stop - shard.first, shard, event.failed)
        except (EOFError, OSError) as fault:
            raise LostProcessError(f"a worker: {child.fate()}") from fault
        return WorkerEvent(refusal="the run: expected to go on, but it is over. Give the command again.")

    def _start(self) -> ChildProcess:
        """Start the process on the adapter of this worker's rank."""
        ends = self._state.ends
        rank = ends.enter_context(local_rank())
        adapters = similar_adapters(self.adapter)
        spec = parse_spec(tomllib.loads(self.text), self.folder)
        slot = WorkerSlot(f"#{adapters[rank % len(adapters)].number}")
        child = start(serve, slot, RunOptions(spec, self.out, self.encoders, self.keep_going))
        ends.callback(child.end)
        self._state.child = child
        return child


def render_shard(name: str, shard: Shard) -> WorkerEvent:
    """Render a shard with the plugin of a name: the task of dask."""
    event: WorkerEvent = get_worker().plugins[name].render(shard)
    return event


def sees(path: str) -> bool:
    """Return whether a file exists on the worker's disk."""
    return Path(path).exists()


@contextmanager
def local_rank() -> Iterator[int]:
    """Yield the least number from 0 that no other process of this user holds on this host: its GPU.

    Held by a lock on a file, which the system releases when its process ends. Where there are no such locks,
    or no place for them, it is 0.
    """
    folder = cache_folder() / "ranks"
    try:
        import fcntl

        make_private(folder)
    except (ImportError, OSError):
        yield 0
        return
    for rank in itertools.count():
        name = folder / f"{socket.gethostname()}-{rank}.lock"
        place = os.open(name, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(place, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(place)
            continue
        try:
            yield rank
        finally:
            os.close(place)
        return
