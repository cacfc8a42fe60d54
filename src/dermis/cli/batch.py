"""The command `dermis batch`: data sets of rendered people with ground truth."""

from __future__ import annotations

import re
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from dermis.base.console import print_json, print_lines, print_note, print_report, spinner
from dermis.base.errors import refuse
from dermis.cli.options import (
    AdapterOption,
    FlagOption,
    IntegerOption,
    JsonOption,
    OptionalOutputPath,
    Options,
    drop_none,
    parse_size,
    refuse_options,
)

if TYPE_CHECKING:
    from dermis.apps.batch.run import Progress, RunReport, WorkerPool
    from dermis.apps.batch.spec import Spec

_MAX_PROCESSES = 1024


def batch(
    spec: Path | None = None,
    /,
    *,
    output: OptionalOutputPath = None,
    count: IntegerOption = None,
    size: str | None = None,
    seed: IntegerOption = None,
    format: Literal["webdataset", "folder"] | None = None,
    shard: str = "0/1",
    part: str = "0/1",
    adapter: AdapterOption = "auto",
    adapters: str | None = None,
    workers: IntegerOption = None,
    workers_per_gpu: IntegerOption = None,
    encoders: IntegerOption = None,
    scheduler: str | None = None,
    cluster: Path | None = None,
    keep_going: FlagOption = False,
    dry_run: FlagOption = False,
    example: FlagOption = False,
    as_json: JsonOption = False,
) -> int:
    """Render a data set with ground truth: people, expressions, lights and cameras drawn from distributions.

    An interrupted command can be continued by repeating it: complete parts of 16 to 32 images are kept. With
    a larger --count, the command adds images to the data set. On the same kind of adapter, a spec always
    gives the same bytes, whatever the number and location of the workers.

    Examples:

        dermis batch --example > spec.toml

        dermis batch spec.toml --dry-run -o sheet.png

        dermis batch spec.toml -o faces --count 2000 --size 512x512

        dermis batch spec.toml -o /shared/faces --shard 3/16 --adapter "#0"

        dermis batch spec.toml -o /shared/faces --scheduler tcp://head:8786

    Parameters
    ----------
    spec:
        File with the distributions of the data set (.toml); see --example.
    output:
        Folder of the data set, created if necessary; with --dry-run, the file for the contact sheet (.png).
    count:
        Number of images; if an existing data set has fewer, images are added. [default: from the spec]
    size:
        Width and height of the images, such as 512x512 [pixel]. [default: from the spec]
    seed:
        Seed of the random numbers. [default: from the spec]
    format:
        Format of the shards: WebDataset tar files, or folders. [default: from the spec]
    shard:
        I/N: render every N-th shard, beginning with shard I (counted from 0); for job arrays with a shared
        disk.
    part:
        I/N: within the shards that --shard selects, render every N-th part, beginning with part I (counted
        from 0); for job arrays with more jobs than shards.
    adapters:
        Numbers of several adapters, such as 0,1; see `dermis doctor`. [default: all GPUs of the best kind]
    workers:
        Number of worker processes. [default: one per GPU, or one per two cores on a software adapter]
    workers_per_gpu:
        Number of worker processes that share each GPU; more than one can increase its utilisation. [default:
        1]
    encoders:
        Number of processes per worker that encode images; with 0, the worker itself encodes them. [default:
        depends on the number of cores]
    scheduler:
        Address of a dask scheduler, such as tcp://head:8786, whose workers render, each on its own GPU.
    cluster:
        File with the address of a dask scheduler, as written by `dask scheduler --scheduler-file FILE`.
    keep_going:
        Skip images that cannot be rendered, and list these images.
    dry_run:
        Do not write the data set: print its parameters, estimate its size and the rendering time, and render
        16 of its images as a contact sheet: the first ones, or four frames of each of the first clips.
    example:
        Print a complete example spec with comments.
    as_json:
        Print one JSON object with counts, time [s], images per second, and skipped shards and images.
    """
    from dermis.apps.batch.spec import example_toml, load_spec

    if example:
        print_lines(example_toml().rstrip("\n"))
        return 0
    shards, parts = _parse_selection("--shard", shard), _parse_selection("--part", part)
    if spec is None:
        refuse("SPEC", "a file", "it is missing", "Print an example spec with --example")
    overrides = drop_none(count=count, size=size and parse_size(size), seed=seed, format=format)
    with spinner("reading the spec"):
        loaded_spec = load_spec(spec, **overrides)
    if dry_run:
        return _dry_run(loaded_spec, adapter, output or Path("dry-run.png"), as_json)
    if output is None:
        refuse("--output", "the folder of the data set", "it is missing", "Name one with -o")
    from dermis.apps.batch.run import run
    from dermis.apps.batch.worker import RunOptions

    if scheduler is not None or cluster is not None:
        local_options = drop_none(adapters=adapters, workers=workers, workers_per_gpu=workers_per_gpu)
        pool: WorkerPool = _dask_cluster(scheduler, cluster, adapter, local_options)
        encoder_count = _check_count("--encoders", encoders, 0)
    else:
        pool, encoder_count = _local_process_pool(adapter, adapters, workers, workers_per_gpu, encoders)
    work = RunOptions(loaded_spec, output, encoder_count or 0, keep_going)
    try:
        with image_progress() as report_progress:
            report = run(work, pool, shards, parts, report_progress)
    except KeyboardInterrupt:
        print_note(f"note: interrupted; complete parts remain in {output}. Run the same command to continue")
        raise
    _print_report(report, output, as_json)
    return 0


def _parse_selection(option: str, option_value: str) -> tuple[int, int]:
    """Return the integers I and N of an option's value "I/N"."""
    match = re.fullmatch(r"(\d{1,9})/(\d{1,9})", option_value)
    if not match or int(match[1]) >= int(match[2]):
        refuse(option, "I/N with I from 0 to N - 1, such as 3/16", f"got {option_value!r}", "Correct it")
    return int(match[1]), int(match[2])


def _check_count(option_name: str, option_value: int | None, minimum: int) -> int | None:
    if option_value is not None and not minimum <= option_value <= _MAX_PROCESSES:
        refuse(option_name, f"{minimum} to {_MAX_PROCESSES}", f"got {option_value}", "Correct it")
    return option_value


def _local_process_pool(
    adapter: str, adapters: str | None, workers: int | None, workers_per_gpu: int | None, encoders: int | None
) -> tuple[WorkerPool, int]:
    """Return a pool of worker processes on this machine, and the number of encoder processes per worker."""
    from dermis.apps.batch.worker_pool import ProcessPool, SlotRequest

    if workers is not None and workers_per_gpu is not None:
        refuse("--workers-per-gpu", "no --workers", "both are given", "Remove one of them")
    request = SlotRequest(
        adapter,
        _parse_adapter_numbers(adapter, adapters),
        _check_count("--workers", workers, 1),
        _check_count("--workers-per-gpu", workers_per_gpu, 1) or 1,
        _check_count("--encoders", encoders, 0),
    )
    slots, encoder_count = request.worker_slots()
    return ProcessPool(slots), encoder_count


def _parse_adapter_numbers(adapter: str, adapters: str | None) -> tuple[int, ...]:
    if adapters is None:
        return ()
    if adapter != "auto":
        refuse("--adapters", "no --adapter", "both are given", "Remove one of them")
    if not re.fullmatch(r"\d{1,4}(,\d{1,4})*", adapters):
        refuse("--adapters", "numbers separated by commas, such as 0,1", f"got {adapters!r}", "Correct it")
    return tuple(map(int, adapters.split(",")))


def _dask_cluster(
    scheduler_address: str | None, scheduler_file: Path | None, adapter: str, local_options: Options
) -> WorkerPool:
    from dermis.apps.batch.dask_cluster import DaskCluster

    if scheduler_address is not None and scheduler_file is not None:
        refuse("--cluster", "no --scheduler", "both are given", "Remove one of them")
    refuse_options(local_options, None, "with a dask cluster", "Remove it and start more dask workers")
    return DaskCluster(scheduler_address, scheduler_file, adapter)


def _print_report(report: RunReport, folder: Path, as_json: bool) -> None:
    rate = report.images / report.seconds if report.images else 0.0
    if as_json:
        failed = [{"image": failure.number, "reason": failure.reason} for failure in report.failed]
        values = {"folder": str(folder), "images": report.images, "seconds": round(report.seconds, 3)}
        values |= {"images_per_s": round(rate, 3), "shards": report.shards, "skipped": report.skipped}
        print_json({**values, "failed": failed, "whole": report.is_complete})
        return
    reused = f" ({report.skipped} reused)" if report.skipped else ""
    speed = f", {rate:.3g} images/s" if rate else ""
    counts = f"{report.images:,} images in {report.shards:,} shards{reused}"
    lines = [f"{folder}  {counts}  {report.seconds:.1f} s{speed}"]
    lines += [f"skipped: image {failure.number}: {failure.reason}" for failure in report.failed]
    if not report.is_complete:
        lines.append("images of other jobs are missing: the last job writes index and data sheet")
    print_lines(*lines)


def _dry_run(spec: Spec, adapter: str, contact_sheet_path: Path, as_json: bool) -> int:
    from dermis.apps.batch.preview import dry_run, estimate_line, parameter_table_lines
    from dermis.images.io import check_output, write_png

    check_output(contact_sheet_path)
    if contact_sheet_path.suffix.lower() != ".png":
        refuse(
            contact_sheet_path,
            "a name that ends in .png",
            "it does not",
            "Name the contact sheet, or omit -o",
        )
    with spinner("rendering a contact sheet"):
        rows, picture, estimate = dry_run(spec, adapter)
    write_png(contact_sheet_path, picture)
    report = {"sheet": str(contact_sheet_path), "parameters": rows, "estimate": estimate}
    print_report(
        as_json,
        report,
        lambda: [*parameter_table_lines(rows), estimate_line(estimate), str(contact_sheet_path)],
    )
    return 0


_LOG_INTERVAL_S = 30.0
_RATE_AVERAGING_S = 60.0  # over which the rate is averaged


@contextmanager
def image_progress() -> Iterator[Callable[[Progress], None]]:
    """Yield a function that shows the progress of a run: images rendered, then shards verified.

    The function updates a progress bar in a terminal, and logs lines if stderr is not a terminal.
    """
    if not sys.stderr.isatty():
        yield ProgressLog(print_note).report
        return
    from rich import progress as rich
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    with rich.Progress(
        *columns, console=Console(stderr=True), speed_estimate_period=_RATE_AVERAGING_S
    ) as bar:
        task = bar.add_task("rendering images", rate="", total=None)
        image_rate = ImageRate()

        def report(progress: Progress) -> None:
            if progress.images < progress.total or not progress.to_verify:
                what, done, total = "rendering images", progress.images, progress.total
                rate = f"{image_rate.update(done):.3g} images/s"
            else:
                what, done, total, rate = "verifying shards", progress.verified, progress.to_verify, ""
            bar.update(task, description=what, completed=done, total=total, rate=rate)

        yield report


class ImageRate:
    """Meter of the number of images per second, averaged over the last minute, for progress messages.

    clock : function that returns the current time [s]
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._samples = deque([(clock(), 0)])

    def update(self, finished_images: int) -> float:
        """Record the number of images finished so far, and return the rate [1/s]."""
        now = self._clock()
        self._samples.append((now, finished_images))
        while len(self._samples) > 2 and now - self._samples[1][0] >= _RATE_AVERAGING_S:
            self._samples.popleft()
        start, done_at_start = self._samples[0]
        return (finished_images - done_at_start) / (now - start) if now > start else 0.0


class ProgressLog:
    """Writer of progress messages to log files, at most one message every 30 seconds.

    write_line : function that writes one line to the log
    clock : function that returns the current time [s]
    """

    def __init__(
        self, write_line: Callable[[str], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._write, self._clock = write_line, clock
        self._rate, self._last = ImageRate(clock), clock()

    def report(self, progress: Progress) -> None:
        """Log the number of finished images and the remaining time, unless the last message is too recent."""
        done, total = progress.images, progress.total
        rate, now = self._rate.update(done), self._clock()
        if now - self._last < _LOG_INTERVAL_S:
            return
        self._last = now
        if done >= total and progress.to_verify:
            self._write(f"{progress.verified:,} of {progress.to_verify:,} shards verified")
            return
        remaining = f"{(total - done) / rate / 60:.0f} min left" if rate else "time left unknown"
        self._write(f"{done:,} of {total:,} images, {rate:.3g} images/s, {remaining}")
