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
from typing import Any, Self

from distributed import WorkerPlugin, get_worker

from dermis.apps.batch.child_processes import Child, LostProcessError, start
from dermis.apps.batch.shards import Shard
from dermis.apps.batch.spec import spec_of
from dermis.apps.batch.worker import Work, WorkerEvent
from dermis.apps.batch.worker_pool import WorkerSlot, serve
from dermis.base.errors import DermisError, DermisWarning
from dermis.base.private import cache_folder, make_private
from dermis.gpu.adapters import alike_adapters

_TRIM = "MALLOC_TRIM_THRESHOLD_"
"""By which dask's nannies have all memory given back at once: large arrays would fault in each time."""


@dataclass
class ShardPlugin(WorkerPlugin):  # type: ignore[misc]
    """Keeps a process of ours beside a worker of dask's, from its first shard to the end of the run.

    It draws as without dask: dask's worker waits for it, and has no part in the drawing.

    text, folder : of the spec; the files that it names are known by their hashes, which are in the text
    out, encoders, keep_going : of `Work`
    adapter : as of `Cluster`
    """

    text: str
    folder: Path
    out: Path
    encoders: int
    keep_going: bool
    adapter: str
    _kept: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, work: Work, adapter: str) -> Self:
        """The plugin for what is to be done."""
        spec = work.spec
        folder, out = spec.folder.resolve(), work.out.resolve()
        return cls(spec.text(), folder, out, work.encoders, work.keep_going, adapter)

    def setup(self, worker: Any) -> None:
        """Called by dask when the worker has the plugin."""
        os.environ.pop(_TRIM, None)
        self._kept = {"lock": threading.Lock(), "ends": ExitStack(), "over": threading.Event()}

    def teardown(self, worker: Any) -> None:
        """Called by dask when the run is over or the worker ends; whoever draws stops by itself."""
        self._kept["over"].set()
        if self._kept["lock"].acquire(blocking=False):
            self._close()
            self._kept["lock"].release()

    def draw(self, shard: Shard) -> WorkerEvent:
        """Draw a shard: what became of it.

        Raises LostProcessError where the process or its device was lost, after which dask tries again.
        """
        with self._kept["lock"]:
            try:
                return self._drawn(shard)
            except LostProcessError:
                self._close()
                raise
            except DermisError as fault:
                return WorkerEvent(refusal=str(fault))
            finally:
                if self._kept["over"].is_set():
                    self._close()

    def _drawn(self, shard: Shard) -> WorkerEvent:
        child = self._child()
        try:
            child.pipe.send(shard)
            while not self._kept["over"].is_set():
                told: WorkerEvent = child.pipe.recv()
                if told.again:
                    raise LostProcessError(told.again)
                if told.note:
                    warnings.warn(told.note, DermisWarning, stacklevel=2)
                if told.refusal:
                    self._close()
                    return told
                if told.shard is not None:
                    return WorkerEvent(shard.stop - shard.first, shard, told.failed)
        except (EOFError, OSError) as fault:
            raise LostProcessError(f"a worker: {child.fate()}") from fault
        return WorkerEvent(refusal="the run: expected to go on, but it is over. Give the command again.")

    def _child(self) -> Child:
        """The process, started for the first shard."""
        if "child" not in self._kept:
            ends = self._kept["ends"]
            rank = ends.enter_context(taken_rank())
            adapters = alike_adapters(self.adapter)
            spec = spec_of(tomllib.loads(self.text), self.folder)
            work = Work(spec, self.out, self.encoders, self.keep_going)
            seat = WorkerSlot(f"#{adapters[rank % len(adapters)].number}")
            self._kept["child"] = start(serve, seat, work)
            ends.callback(self._kept["child"].end)
        found: Child = self._kept["child"]
        return found

    def _close(self) -> None:
        self._kept.pop("child", None)
        self._kept["ends"].close()


def render_shard(name: str, shard: Shard) -> WorkerEvent:
    """The task: draw a shard with the plugin of that name."""
    told: WorkerEvent = get_worker().plugins[name].draw(shard)
    return told


def sees(mark: str) -> bool:
    """Whether a file is there."""
    return Path(mark).exists()


@contextmanager
def taken_rank() -> Iterator[int]:
    """The least number from 0 on that no other process of this user has on this host, while the block runs.

    Held by a lock on a file, which the system releases when its process ends, however it does. Where there
    are no such locks, or no place for them, it is 0.
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
