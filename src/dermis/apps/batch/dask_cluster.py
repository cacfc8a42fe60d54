"""Crew of dask.distributed workers, on this machine or many, each with an adapter of its own."""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dermis.apps.batch.shards import Shard
from dermis.apps.batch.worker import RunOptions, WorkerEvent
from dermis.base.errors import DermisError, refuse
from dermis.base.extras import needed

if TYPE_CHECKING:
    from distributed import Client

_RETRIES = 2  # of a shard whose worker reports a loss; dask itself counts those that die
_WAIT_S = 60.0  # for a scheduler, and for its first worker


@dataclass(frozen=True)
class Cluster:
    """Crew of dask's workers; each renders one shard at a time.

    address : of the scheduler; None with a file
    file : that the scheduler wrote
    adapter : as of `SlotRequest`; the workers of a host take those that fit in turn
    """

    address: str | None
    file: Path | None
    adapter: str = "auto"

    def render(self, work: RunOptions, shards: Sequence[Shard]) -> Iterator[WorkerEvent]:
        """Render the shards, each as a task, and yield an event for each.

        Raises DermisError where no worker is reached, where one sees another disk, and for what no worker
        can mend.
        """
        needed("distributed", "--scheduler and --cluster")
        from dermis.apps.batch.dask_worker import ShardPlugin

        name = f"dermis-{secrets.token_hex(6)}"
        with self._client() as client:
            client.register_plugin(ShardPlugin.of(work, self.adapter), name=name)
            try:
                with _mark(work.out) as mark:
                    _check_disks(client, mark)
                yield from _events(client, name, shards)
            finally:
                with suppress(OSError, TimeoutError):  # the scheduler is gone
                    client.unregister_worker_plugin(name)

    @contextmanager
    def _client(self) -> Iterator[Client]:
        from distributed import Client

        if self.file is not None and not self.file.is_file():
            refuse(self.file, "the file that dask's scheduler wrote", "it is not there", "Start it first")
        where = {"address": self.address} if self.file is None else {"scheduler_file": str(self.file)}
        culprit = self.address or self.file
        try:
            client = Client(**where, timeout=_WAIT_S, set_as_default=False)
        except (OSError, ValueError) as fault:
            refuse(culprit, "a scheduler of dask.distributed", f"none answers ({fault})", "Start it first")
        with client:
            try:
                client.wait_for_workers(1, timeout=_WAIT_S)
            except TimeoutError:
                refuse(culprit, "a scheduler with workers", "it has none", "Start them with dask worker")
            yield client


@contextmanager
def _mark(out: Path) -> Iterator[Path]:
    """Create a file that all workers that share the disk can see, while the block runs."""
    place = out.resolve() / f".dermis-{secrets.token_hex(6)}"
    place.touch()
    try:
        yield place
    finally:
        place.unlink()


def _check_disks(client: Client, mark: Path) -> None:
    """Refuse a folder that is not the same for all workers."""
    from dermis.apps.batch.dask_worker import sees

    blind = [address for address, found in client.run(sees, str(mark)).items() if not found]
    if blind:
        came = f"{blind[0]} does not see it"
        refuse(mark.parent, "a folder on a disk that all workers share", came, "Choose another one")


def _events(client: Client, name: str, shards: Sequence[Shard]) -> Iterator[WorkerEvent]:
    """Yield the completion of each shard."""
    from distributed import as_completed

    from dermis.apps.batch.dask_worker import render_shard

    tasks = {
        client.submit(render_shard, name, shard, key=f"{name}-{shard.index}", retries=_RETRIES): shard
        for shard in shards
    }
    try:
        for done in as_completed(list(tasks), loop=client.loop):
            shard = tasks.pop(done)
            if done.status != "finished":
                raise DermisError(
                    f"shard {shard.index}: expected a worker of dask's to draw it, but they failed: "
                    f"{done.exception()}. What is whole is kept; give the command again to go on."
                )
            event: WorkerEvent = done.result()
            if event.refusal:
                raise DermisError(event.refusal)
            yield event
    finally:
        client.cancel(list(tasks))
