"""What runs in a worker of dask.distributed."""

from __future__ import annotations

import threading
import tomllib
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from distributed import WorkerPlugin, get_worker

from dermis.batch.allocator import keep_freed_memory
from dermis.batch.faults import LostProcessError
from dermis.batch.ranks import taken_rank
from dermis.batch.shards import Shard
from dermis.batch.spec import spec_of
from dermis.batch.told import Told
from dermis.batch.worker import Work, Worker
from dermis.errors import DermisError
from dermis.gpu.adapters import alike_adapters
from dermis.gpu.failures import DeviceError


@dataclass
class Drawing(WorkerPlugin):  # type: ignore[misc]
    """Keeps a worker of ours in one of dask's, from its first shard to the end of the run.

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
        keep_freed_memory()
        self._kept = {"lock": threading.Lock(), "ends": ExitStack(), "over": threading.Event()}

    def teardown(self, worker: Any) -> None:
        """Called by dask when the run is over or the worker ends; whoever draws stops by itself."""
        self._kept["over"].set()
        if self._kept["lock"].acquire(blocking=False):
            self._close()
            self._kept["lock"].release()

    def draw(self, shard: Shard) -> Told:
        """Draw a shard: what became of it.

        Raises DeviceError and LostProcessError, after which dask tries again.
        """
        with self._kept["lock"]:
            try:
                failed = self._worker().draw(shard, self._go_on)
            except (DeviceError, LostProcessError):
                self._close()
                raise
            except DermisError as fault:
                return Told(refusal=str(fault))
            finally:
                if self._kept["over"].is_set():
                    self._close()
        return Told(shard.stop - shard.first, shard, failed)

    def _go_on(self) -> None:
        if self._kept["over"].is_set():
            raise DermisError("the run: expected to go on, but it is over. Give the command again.")

    def _worker(self) -> Worker:
        """Ours, opened for the first shard."""
        if "worker" not in self._kept:
            ends = self._kept["ends"]
            rank = ends.enter_context(taken_rank())
            adapters = alike_adapters(self.adapter)
            spec = spec_of(tomllib.loads(self.text), self.folder)
            work = Work(spec, self.out, self.encoders, self.keep_going)
            chosen = f"#{adapters[rank % len(adapters)].number}"
            self._kept["worker"] = ends.enter_context(Worker(chosen, work))
        found: Worker = self._kept["worker"]
        return found

    def _close(self) -> None:
        self._kept.pop("worker", None)
        self._kept["ends"].close()


def draw_shard(name: str, shard: Shard) -> Told:
    """The task: draw a shard with the plugin of that name."""
    told: Told = get_worker().plugins[name].draw(shard)
    return told


def sees(mark: str) -> bool:
    """Whether a file is there."""
    return Path(mark).exists()
