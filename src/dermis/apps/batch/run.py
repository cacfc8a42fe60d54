"""Run of a data set: render the missing shards, then write the index and the datasheet."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from dermis.apps.batch.atomic_files import atomic_write
from dermis.apps.batch.datasheet import write_datasheet
from dermis.apps.batch.index import write_index
from dermis.apps.batch.shards import Shard, is_intact, list_shards, remove_unfinished, shard_exists
from dermis.apps.batch.spec import GENERATOR, Spec
from dermis.apps.batch.worker import Failure, RunOptions, WorkerEvent
from dermis.base.atomic_write import refuse_output
from dermis.base.errors import notify, refuse
from dermis.base.reading import read_text, read_toml

SPEC_FILE = "spec.toml"
"""Name of the spec in the folder of its data set: another one is refused there."""


class WorkerPool(Protocol):
    """Protocol of worker pools: `ProcessPool` on this machine, or `DaskCluster` on several."""

    def render(self, options: RunOptions, shards: Sequence[Shard]) -> Iterator[WorkerEvent]:
        """Render the shards, each completely or not at all, and yield events as they happen."""
        ...


@dataclass
class Progress:
    """Progress of a run, reported to `on_progress`.

    images : number of images rendered so far
    total : number of images in the shards that were missing at the start
    """

    images: int = 0
    total: int = 0


@dataclass(frozen=True)
class RunReport:
    """Result of a run.

    images : number of images in the written shards, without those that could not be rendered
    seconds : duration of the run [s]
    shards : number of written shards
    skipped : number of shards that were complete before the run
    failed : images that could not be rendered, with the reasons
    is_complete : whether all shards of the data set, its index and its datasheet exist
    """

    images: int
    seconds: float
    shards: int
    skipped: int
    failed: tuple[Failure, ...] = ()
    is_complete: bool = False


def run(
    options: RunOptions,
    pool: WorkerPool,
    part: tuple[int, int] = (0, 1),
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> RunReport:
    """Render the missing shards of a data set, or of a part of it; then write index and datasheet.

    pool : workers that render the shards
    part : (i, n) selects every n-th shard, starting with the i-th (from 0), so that n runs share a data set
    on_progress : function called whenever images were rendered

    Raises DermisError for errors of the spec, the disk or the machine; complete shards are kept.
    """
    start = time.monotonic()
    claim_folder(options.out, options.spec)
    all_shards = list_shards(options.spec)
    selected = all_shards[part[0] :: part[1]]
    missing = [shard for shard in selected if not is_intact(options.out, shard, options.spec)]
    remove_unfinished(options.out, selected)
    try:
        images, failed = _render_missing(pool, options, missing, on_progress)
    finally:
        remove_unfinished(options.out, selected)
    complete = all(shard_exists(options.out, shard, options.spec) for shard in all_shards)
    if complete:  # concurrent runs that reach this point write the same bytes
        write_index(options.out, options.spec)
        write_datasheet(options.out, options.spec)
    seconds = time.monotonic() - start
    return RunReport(images, seconds, len(missing), len(selected) - len(missing), failed, complete)


def claim_folder(out: Path, spec: Spec) -> None:
    """Create the folder of a data set, or check that an existing folder holds the data set of this spec.

    Raises DermisError if the folder belongs to another data set or cannot be written.
    """
    path = out / SPEC_FILE
    try:
        out.mkdir(parents=True, exist_ok=True)
        exists = path.exists()
    except (OSError, ValueError) as fault:  # ValueError: a NUL in the name
        refuse_output(out, fault)
    if not exists:
        atomic_write(path, lambda temporary: temporary.write_text(spec.to_toml(), encoding="utf-8"))
    elif read_text(path, "the spec of a data set") != spec.to_toml():
        number = _generator_number(path)
        if number != GENERATOR:
            expected = f"a data set whose people are drawn by generator {GENERATOR}"
            advice = "Choose another folder, or continue it with the version that began it"
            refuse(out, expected, f"those of its {SPEC_FILE} are by generator {number}", advice)
        advice = "Choose another folder, or use the spec that the folder was created with"
        refuse(out, "a folder for this data set", f"its {SPEC_FILE} differs from this spec", advice)


def _generator_number(path: Path) -> object:
    """Return the generator number of a written spec; those without one are of the first."""
    return read_toml(path, "the spec of a data set").get("generator", 1)


def _render_missing(
    pool: WorkerPool, options: RunOptions, missing: Sequence[Shard], on_progress: Callable[[Progress], None]
) -> tuple[int, tuple[Failure, ...]]:
    """Render the missing shards; return the number of images in them, and the images that failed."""
    progress = Progress(0, sum(shard.stop - shard.first for shard in missing))
    failed: list[Failure] = []
    notes = set[str]()
    for event in pool.render(options, missing) if missing else ():
        if event.note and event.note not in notes:
            notes.add(event.note)
            notify(event.note)
        if event.retry:
            notify(f"{event.retry}; its shard is rendered again")
        failed += event.failed
        if event.images:
            progress.images += event.images
            on_progress(progress)
    return progress.total - len(failed), tuple(sorted(failed))
