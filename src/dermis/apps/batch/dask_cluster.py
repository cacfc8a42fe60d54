"""Pool of dask.distributed workers on one or several machines; each worker uses one graphics adapter."""

from __future__ import annotations

import itertools
import secrets
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dermis.apps.batch.shards import Shard
from dermis.apps.batch.worker import RunOptions, WorkerEvent
from dermis.base.errors import DermisError, refuse
from dermis.base.extras import import_extra

if TYPE_CHECKING:
    from distributed import Client

_MAX_TASK_RETRIES = 2  # of a part whose worker reports a lost process; dask itself counts workers that die
_MAX_TASKS_IN_FLIGHT = 1000  # submitted to the scheduler; far more than there are workers
_CONNECTION_TIMEOUT_S = 60.0  # for the scheduler, and for its first worker


@dataclass(frozen=True)
class DaskCluster:
    """Pool of dask workers, each of which renders one part of a shard at a time.

    address : address of the scheduler; None if `file` is given
    file : scheduler file, written by `dask scheduler --scheduler-file`
    adapter : graphics adapters to use, as in `SlotRequest`; the workers of a host are assigned the matching
        adapters in turn
    """

    address: str | None
    file: Path | None
    adapter: str = "auto"

    def render(self, options: RunOptions, tasks: Sequence[Shard]) -> Iterator[WorkerEvent]:
        """Process the tasks as dask tasks, and yield an event for each completed task.

        tasks : parts of shards to render, and complete shards to verify

        Raises DermisError if no worker can be reached, if a worker does not share the disk, and for errors
        that would recur on another attempt.
        """
        import_extra("distributed", "--scheduler and --cluster")
        from dermis.apps.batch.dask_worker import PartPlugin

        name = f"dermis-{secrets.token_hex(6)}"
        with self._client() as client:
            client.register_plugin(PartPlugin.from_run_options(options, self.adapter), name=name)
            try:
                with _create_marker_file(options.out) as marker:
                    _check_shared_disk(client, marker)
                yield from _submit_tasks(client, name, tasks)
            finally:
                with suppress(OSError, TimeoutError):  # the scheduler is gone
                    client.unregister_worker_plugin(name)

    @contextmanager
    def _client(self) -> Iterator[Client]:
        from distributed import Client

        if self.file is not None and not self.file.is_file():
            refuse(self.file, "the file that dask's scheduler wrote", "it does not exist", "Start it first")
        scheduler = {"address": self.address} if self.file is None else {"scheduler_file": str(self.file)}
        error_subject = self.address or self.file
        try:
            client = Client(**scheduler, timeout=_CONNECTION_TIMEOUT_S, set_as_default=False)
        except (OSError, ValueError) as fault:
            refuse(
                error_subject, "a scheduler of dask.distributed", f"none answers ({fault})", "Start it first"
            )
        with client:
            try:
                client.wait_for_workers(1, timeout=_CONNECTION_TIMEOUT_S)
            except TimeoutError:
                refuse(
                    error_subject, "a scheduler with workers", "it has none", "Start them with dask worker"
                )
            yield client


@contextmanager
def _create_marker_file(dataset_folder: Path) -> Iterator[Path]:
    """Yield a new marker file in the output folder, which every worker that shares the disk can see.

    The file is removed at the end of the block.
    """
    marker = dataset_folder.resolve() / f".dermis-{secrets.token_hex(6)}"
    marker.touch()
    try:
        yield marker
    finally:
        marker.unlink()


def _check_shared_disk(client: Client, marker_file: Path) -> None:
    """Raise DermisError if some dask workers do not see the marker file in the output folder."""
    from dermis.apps.batch.dask_worker import path_exists

    failing = [address for address, found in client.run(path_exists, str(marker_file)).items() if not found]
    if failing:
        actual = f"{failing[0]} does not see it"
        refuse(marker_file.parent, "a folder on a disk that all workers share", actual, "Choose another one")


def _submit_tasks(client: Client, plugin_name: str, tasks: Sequence[Shard]) -> Iterator[WorkerEvent]:
    """Submit the tasks to dask, and yield an event whenever a task is complete.

    plugin_name : name of the `PartPlugin` that processes the tasks
    tasks : parts of shards to render, and complete shards to verify
    """
    from distributed import Future, as_completed

    from dermis.apps.batch.dask_worker import run_task

    queue, submitted = deque(tasks), dict[Future, Shard]()
    keys, completed = itertools.count(), as_completed(loop=client.loop)

    def submit_waiting_tasks() -> None:
        while queue and len(submitted) < _MAX_TASKS_IN_FLIGHT:
            task = queue.popleft()
            future = client.submit(
                run_task, plugin_name, task, key=f"{plugin_name}-{next(keys)}", retries=_MAX_TASK_RETRIES
            )
            submitted[future] = task
            completed.add(future)

    try:
        submit_waiting_tasks()
        for done in completed:
            task = submitted.pop(done)
            if done.status != "finished":
                raise DermisError(
                    f"{task}: expected a dask worker to render it, but they failed: "
                    f"{done.exception()}. Complete parts are kept; run the command again to continue."
                )
            event: WorkerEvent = done.result()
            if event.refusal:
                raise DermisError(event.refusal)
            queue.extendleft(reversed(event.missing))
            submit_waiting_tasks()
            yield event
    finally:
        client.cancel(list(submitted))
