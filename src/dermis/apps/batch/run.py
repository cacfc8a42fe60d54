"""Run of a data set: render the missing shards, then write its index and datasheet."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from dermis.apps.batch.atomic_files import atomic_write
from dermis.apps.batch.datasheet import write_datasheet
from dermis.apps.batch.index import write_index
from dermis.apps.batch.shards import Shard, is_there, is_whole, remove_unfinished, list_shards
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.worker import Failure, RunOptions, WorkerEvent
from dermis.base.atomic_write import refuse_output
from dermis.base.errors import notify, refuse
from dermis.base.reading import read_text

SPEC_FILE = "spec.toml"
"""Name of the spec in the folder of its data set: another one is refused there."""


class WorkerPool(Protocol):
    """Workers: `ProcessPool` of this machine, or those of a `Cluster`."""

    def render(self, work: RunOptions, shards: Sequence[Shard]) -> Iterator[WorkerEvent]:
        """Render the shards, each completely or not at all, and yield events as they happen."""
        ...


@dataclass
class Progress:
    """Progress of a run.

    images : rendered so far
    to_draw : images of the shards that were missing at the start
    """

    images: int = 0
    to_draw: int = 0


@dataclass(frozen=True)
class Report:
    """Result of a run.

    images : in the shards that it wrote, without those that were left out
    seconds : duration
    shards : number that it wrote
    skipped : shards that were complete before
    failed : images that were left out
    is_whole : whether all shards of the data set are there, and with them index and datasheet
    """

    images: int
    seconds: float
    shards: int
    skipped: int
    failed: tuple[Failure, ...] = ()
    is_whole: bool = False


def run(
    work: RunOptions,
    crew: WorkerPool,
    part: tuple[int, int] = (0, 1),
    told: Callable[[Progress], None] = lambda progress: None,
) -> Report:
    """Render the missing shards of a data set, or of a part of it.

    part : (i, n) for every n-th shard from the i-th on, i from 0: n runs, on any machines, make the data set
    told : called whenever images were rendered

    Raises DermisError for faults of the spec, the disk or the machine; complete shards stay.
    """
    began = time.monotonic()
    claim(work.out, work.spec)
    every = list_shards(work.spec)
    mine = every[part[0] :: part[1]]
    missing = [shard for shard in mine if not is_whole(work.out, shard, work.spec)]
    remove_unfinished(work.out, mine)
    try:
        images, failed = _render(crew, work, missing, told)
    finally:
        remove_unfinished(work.out, mine)
    whole = all(is_there(work.out, shard, work.spec) for shard in every)
    if whole:  # every run that sees this writes the same bytes
        write_index(work.out, work.spec)
        write_datasheet(work.out, work.spec)
    seconds = time.monotonic() - began
    return Report(images, seconds, len(missing), len(mine) - len(missing), failed, whole)


def claim(out: Path, spec: Spec) -> None:
    """Make the folder of a data set, or check that it was begun with the same spec.

    Raises DermisError for a folder of another one, and where nothing can be written.
    """
    path = out / SPEC_FILE
    try:
        out.mkdir(parents=True, exist_ok=True)
        exists = path.exists()
    except (OSError, ValueError) as fault:  # ValueError: a NUL in the name
        refuse_output(out, fault)
    if not exists:
        atomic_write(path, lambda trial: trial.write_text(spec.text(), encoding="utf-8"))
    elif read_text(path, "the spec of a data set") != spec.text():
        remedy = "Choose another folder, or give the spec that it was begun with"
        refuse(out, "a folder for this data set", f"{SPEC_FILE} in it is another's", remedy)


def _render(
    crew: WorkerPool, work: RunOptions, missing: Sequence[Shard], told: Callable[[Progress], None]
) -> tuple[int, tuple[Failure, ...]]:
    """Return the number of images in the rendered shards, and those left out of them."""
    progress = Progress(0, sum(shard.stop - shard.first for shard in missing))
    failed: list[Failure] = []
    notes = set[str]()
    for event in crew.render(work, missing) if missing else ():
        if event.note and event.note not in notes:
            notes.add(event.note)
            notify(event.note)
        if event.retry:
            notify(f"{event.retry}; its shard is drawn again")
        failed += event.failed
        if event.images:
            progress.images += event.images
            told(progress)
    return progress.to_draw - len(failed), tuple(sorted(failed))
