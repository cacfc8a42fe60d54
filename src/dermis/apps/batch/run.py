"""Rendering of a data set: missing parts of shards are rendered, then index and datasheet are written."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from dermis.apps.batch.atomic_files import atomic_write, remove_path
from dermis.apps.batch.datasheet import write_datasheet
from dermis.apps.batch.index import write_index
from dermis.apps.batch.shards import (
    Part,
    Shard,
    list_parts,
    list_shards,
    part_files,
    remove_unfinished_files,
    shard_at,
    shard_exists,
    shard_path,
)
from dermis.apps.batch.spec import COUNT_LINE_PATTERN, GENERATOR_LINE_PATTERN, GENERATOR_VERSION, Spec
from dermis.apps.batch.worker import Failure, RunOptions, WorkerEvent
from dermis.base.atomic_write import refuse_output
from dermis.base.errors import notify, refuse
from dermis.base.extras import import_extra
from dermis.base.reading import read_text

SPEC_FILE = "spec.toml"
"""Name of the copy of the spec in the folder of a data set; a run with another spec refuses this folder."""


class WorkerPool(Protocol):
    """Protocol of worker pools: `ProcessPool` on this machine, or `DaskCluster` on several."""

    def render(self, options: RunOptions, tasks: Sequence[Shard]) -> Iterator[WorkerEvent]:
        """Render parts of shards, and verify complete shards; yield the events that the workers send.

        tasks : objects of the class `Part` are rendered, and all other shards are verified; the damaged parts
            of a shard are rendered again
        """
        ...


@dataclass
class Progress:
    """Progress of a run, passed to the argument `on_progress` of the function `run`.

    total : number of images in the parts that were missing at the start
    images : how many of these images were rendered so far, or were found on the disk
    to_verify : number of shards that were complete at the start
    verified : how many of these shards were read and compared with their hash so far
    """

    images: int = 0
    total: int = 0
    verified: int = 0
    to_verify: int = 0


@dataclass(frozen=True)
class RunReport:
    """Result of a run.

    images : number of images that were rendered
    seconds : duration of the run [s]
    shards : number of shards that became complete during the run
    skipped : number of shards that were complete before the run
    failed : images that could not be rendered, with the reasons
    is_complete : whether all shards, the index and the datasheet of the data set exist
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
    shard_selection: tuple[int, int] = (0, 1),
    part_selection: tuple[int, int] = (0, 1),
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> RunReport:
    """Render missing parts of a data set; if the data set is then complete, write index and datasheet.

    pool : workers that render the parts
    shard_selection : (i, n) selects every n-th shard, starting with shard i, so that n runs can share a data
        set
    part_selection : (i, n) selects every n-th part of these shards, starting with part i
    on_progress : function called whenever images were rendered or a shard was verified

    Raises DermisError for errors of the spec, the disk or the machine; complete parts are kept.
    """
    start = time.monotonic()
    out, spec = options.out, options.spec
    for package in ("pyarrow.parquet", "isal.isal_zlib"):
        import_extra(package, "a data set")
    claim_folder(out, spec)
    all_shards = list_shards(spec)
    selected = all_shards[shard_selection[0] :: shard_selection[1]]
    existing = {shard for shard in selected if shard_exists(out, shard, spec)}
    share = [part for shard in selected for part in list_parts(shard, spec)][
        part_selection[0] :: part_selection[1]
    ]
    missing = [part for part in share if shard_at(part.index, spec) not in existing]
    verified = [shard for shard in selected if shard in existing][part_selection[0] :: part_selection[1]]
    removable_names = {
        shard_path(out, one, spec).name for one in (*missing, *(selected if part_selection[1] == 1 else ()))
    }
    remove_unfinished_files(out, removable_names)
    _remove_joined_parts(out, spec, existing)
    try:
        images, damaged, failed = _run_tasks(pool, options, [*missing, *verified], on_progress)
    finally:
        remove_unfinished_files(out, removable_names)
    complete_shards = {shard for shard in all_shards if shard_exists(out, shard, spec)}
    complete = len(complete_shards) == len(all_shards)
    if complete:  # concurrent runs that reach this point write the same bytes
        remove_unfinished_files(out)
        write_index(out, spec)
        write_datasheet(out, spec)
    kept = existing - damaged
    written = len(complete_shards.intersection(selected) - kept)
    return RunReport(images, time.monotonic() - start, written, len(kept), failed, complete)


def claim_folder(dataset_folder: Path, spec: Spec) -> None:
    """Create the folder of a data set, or check that an existing folder holds the data set of this spec.

    The existing data set may have fewer images than this spec; the spec in the folder is then replaced.

    Raises DermisError if the folder belongs to another data set or cannot be written.
    """
    path, text = dataset_folder / SPEC_FILE, spec.to_toml()
    try:
        dataset_folder.mkdir(parents=True, exist_ok=True)
        exists = path.exists()
    except (OSError, ValueError) as fault:  # ValueError: a NUL in the name
        refuse_output(dataset_folder, fault)
    if exists and not _is_smaller_version(read_text(path, "the spec of a data set"), spec, dataset_folder):
        return
    atomic_write(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def _is_smaller_version(existing_toml: str, spec: Spec, dataset_folder: Path) -> bool:
    """Return whether the spec in a data set's folder differs from this spec only by having fewer images.

    existing_toml : text of the spec in the folder

    Raises DermisError if the specs differ in anything else.
    """
    if existing_toml == spec.to_toml():
        return False
    other_folder, count = "Choose another folder", COUNT_LINE_PATTERN.search(existing_toml)
    generator = GENERATOR_LINE_PATTERN.search(existing_toml)
    number = int(generator[1]) if generator else 1  # earlier versions wrote none
    if number != GENERATOR_VERSION:
        actual = f"it was made with number {number}, by another version of dermis"
        refuse(
            dataset_folder,
            f"a data set of generator number {GENERATOR_VERSION}",
            actual,
            f"{other_folder}, or that version",
        )
    if not count or COUNT_LINE_PATTERN.sub("", existing_toml, count=1) != COUNT_LINE_PATTERN.sub(
        "", spec.to_toml(), count=1
    ):
        advice = f"{other_folder}, or use the spec that the folder was created with"
        refuse(
            dataset_folder, "a folder for this data set", f"its {SPEC_FILE} differs from this spec", advice
        )
    if int(count[1]) > spec.count:
        expected, actual = f"a count of at least the {count[1]} images that it has", f"got {spec.count}"
        refuse(dataset_folder, expected, actual, f"Use --count {count[1]}, or choose another folder")
    return True


def _remove_joined_parts(dataset_folder: Path, spec: Spec, complete_shards: Iterable[Shard]) -> None:
    """Remove the parts of complete shards, left over by a run that was interrupted after joining them."""
    if files := part_files(dataset_folder):
        complete_shards = set(complete_shards)
        for number, path in files.items():
            if shard_at(number // spec.shard_size, spec) in complete_shards:
                remove_path(path)


def _run_tasks(
    pool: WorkerPool,
    options: RunOptions,
    tasks: Sequence[Shard],
    on_progress: Callable[[Progress], None],
) -> tuple[int, set[Shard], tuple[Failure, ...]]:
    """Process the tasks with a pool; return the image count, the damaged shards and the failed images.

    tasks : parts of shards to render, and complete shards to verify
    on_progress : function called whenever images were rendered or a shard was verified

    The image count is the number of rendered images; failed images are those that could not be rendered.
    """
    to_render = [task for task in tasks if isinstance(task, Part)]
    progress = Progress(total=sum(map(len, to_render)), to_verify=len(tasks) - len(to_render))
    rendered, damaged, failed, notes = 0, set[Shard](), list[Failure](), set[str]()
    for event in pool.render(options, tasks) if tasks else ():
        if event.note and event.note not in notes:
            notes.add(event.note)
            notify(event.note)
        if event.retry:
            notify(f"{event.retry}; its part is rendered again")
        progress.images += event.images
        progress.total += sum(map(len, event.missing))
        if isinstance(event.done, Part):
            rendered += event.rendered
            failed += event.failed
            progress.images += len(event.done) - event.rendered
        elif event.done is not None:
            progress.verified += 1
            damaged |= {event.done} if event.missing else set()
        progress.images = min(progress.images, progress.total)  # images of lost workers are rendered twice
        if event.images or event.done is not None:
            on_progress(progress)
    return rendered, damaged, tuple(sorted(failed))
