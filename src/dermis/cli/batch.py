"""`dermis batch`: a data set of many people, with what is known about each picture."""

from __future__ import annotations

import re
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from dermis.base.console import note, print_json, print_lines, print_report, working_on
from dermis.base.errors import refuse
from dermis.cli.options import Adapter, Flag, Json, Options, Output, Integer, given, parse_size

if TYPE_CHECKING:
    from dermis.apps.batch.run import WorkerPool, Report
    from dermis.apps.batch.spec import Spec

_MAX_PROCESSES = 1024


def batch(
    spec: Path | None = None,
    /,
    *,
    output: Output = None,
    count: Integer = None,
    size: str | None = None,
    seed: Integer = None,
    format: Literal["webdataset", "folder"] | None = None,
    shard: str = "0/1",
    adapter: Adapter = "auto",
    adapters: str | None = None,
    workers: Integer = None,
    workers_per_gpu: Integer = None,
    encoders: Integer = None,
    scheduler: str | None = None,
    cluster: Path | None = None,
    keep_going: Flag = False,
    dry_run: Flag = False,
    example: Flag = False,
    as_json: Json = False,
) -> int:
    """Draw a data set: people, faces, light and cameras from stated distributions, with ground truth.

    An interrupted command goes on where it was when it is given again: shards that are whole are kept. The
    same spec gives the same bytes on the same kind of adapter, however many workers draw it and wherever.

    Examples:

        dermis batch --example > spec.toml

        dermis batch spec.toml --dry-run -o sheet.png

        dermis batch spec.toml -o faces --count 2000 --size 512x512

        dermis batch spec.toml -o /shared/faces --shard 3/16 --adapter "#0"

        dermis batch spec.toml -o /shared/faces --scheduler tcp://head:8786

    Parameters
    ----------
    spec:
        What is drawn (.toml), see --example.
    output:
        Folder of the data set, made if it is not there; with --dry-run the contact sheet (.png).
    count:
        Number of images, in place of the spec's.
    size:
        Of the images, WIDTHxHEIGHT, in place of the spec's.
    seed:
        By which all is drawn, in place of the spec's.
    format:
        Shards as tar files of WebDataset, or as folders; in place of the spec's.
    shard:
        I/N: every N-th shard from the I-th on, counted from 0, for arrays of jobs that share a disk.
    adapters:
        Numbers of several, such as 0,1, as `dermis doctor` has them [all GPUs of the best kind].
    workers:
        Processes that draw [one for each GPU; on a software adapter one for two cores].
    workers_per_gpu:
        Processes that share a GPU, which Python alone does not fill [1].
    encoders:
        Processes of each worker that encode pictures; 0 lets it encode itself [by the number of cores].
    scheduler:
        Address of dask's scheduler, such as tcp://head:8786: each of its workers draws on a GPU of its own.
    cluster:
        The file that dask's scheduler wrote (dask scheduler --scheduler-file FILE), for its address.
    keep_going:
        Leave out images that cannot be made, and list them.
    dry_run:
        Print what would be drawn, draw the first 16 images as a contact sheet, and write no data set.
    example:
        Print a spec with comments that can be drawn as it is.
    as_json:
        Print one JSON object: counts, seconds, images/s, shards, what was skipped and what was left out.
    """
    from dermis.apps.batch.spec import example_toml, load_spec

    if example:
        print_lines(example_toml().rstrip("\n"))
        return 0
    part = _part(shard)
    if spec is None:
        refuse("SPEC", "a file", "none was named", "Print one to start from with --example")
    changed = given(count=count, size=size and parse_size(size), seed=seed, format=format)
    with working_on("reading the spec"):
        read = load_spec(spec, **changed)
    if dry_run:
        return _dry_run(read, adapter, output or Path("dry-run.png"), as_json)
    if output is None:
        refuse("--output", "the folder of the data set", "none was named", "Name one with -o")
    from dermis.apps.batch.run import run
    from dermis.apps.batch.worker import RunOptions

    if scheduler is not None or cluster is not None:
        elsewhere = given(adapters=adapters, workers=workers, workers_per_gpu=workers_per_gpu)
        crew, each = _cluster(scheduler, cluster, adapter, elsewhere), _number("--encoders", encoders, 0)
    else:
        crew, each = _crew(adapter, adapters, workers, workers_per_gpu, encoders)
    work = RunOptions(read, output, each or 0, keep_going)
    with image_progress() as told:
        report = run(work, crew, part, lambda now: told(now.images, now.to_draw))
    _tell(report, output, as_json)
    return 0


def _part(text: str) -> tuple[int, int]:
    """Return I and N of --shard I/N."""
    match = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text)
    if not match or int(match[1]) >= int(match[2]):
        refuse("--shard", "I/N with I from 0 to N - 1, such as 3/16", f"{text!r} came", "Correct it")
    return int(match[1]), int(match[2])


def _number(option: str, value: int | None, least: int) -> int | None:
    if value is not None and not least <= value <= _MAX_PROCESSES:
        refuse(option, f"{least} to {_MAX_PROCESSES}", f"{value} came", "Correct it")
    return value


def _crew(
    adapter: str, adapters: str | None, workers: int | None, per_gpu: int | None, encoders: int | None
) -> tuple[WorkerPool, int]:
    """Return the processes of this machine, and how many encoders each has."""
    from dermis.apps.batch.worker_pool import ProcessPool, SlotRequest

    if workers is not None and per_gpu is not None:
        refuse("--workers-per-gpu", "no such option beside --workers", "it came", "Leave one of them out")
    request = SlotRequest(
        adapter,
        _numbers(adapter, adapters),
        _number("--workers", workers, 1),
        _number("--workers-per-gpu", per_gpu, 1) or 1,
        _number("--encoders", encoders, 0),
    )
    slots, each = request.slots()
    return ProcessPool(slots), each


def _numbers(adapter: str, adapters: str | None) -> tuple[int, ...]:
    if adapters is None:
        return ()
    if adapter != "auto":
        refuse("--adapters", "no such option beside --adapter", "it came", "Leave one of them out")
    if not re.fullmatch(r"\d{1,4}(,\d{1,4})*", adapters):
        refuse("--adapters", "numbers with commas, such as 0,1", f"{adapters!r} came", "Correct it")
    return tuple(map(int, adapters.split(",")))


def _cluster(address: str | None, file: Path | None, adapter: str, elsewhere: Options) -> WorkerPool:
    from dermis.apps.batch.dask_cluster import Cluster

    if address is not None and file is not None:
        refuse("--cluster", "no such option beside --scheduler", "it came", "Leave one of them out")
    for name in elsewhere:
        option = f"--{name.replace('_', '-')}"
        refuse(option, "no such option with dask's workers", "it came", "Start as many of them as you want")
    return Cluster(address, file, adapter)


def _tell(report: Report, out: Path, as_json: bool) -> None:
    rate = report.images / report.seconds if report.images else 0.0
    if as_json:
        failed = [{"image": one.number, "reason": one.reason} for one in report.failed]
        values = {"folder": str(out), "images": report.images, "seconds": round(report.seconds, 3)}
        values |= {"images_per_s": round(rate, 3), "shards": report.shards, "skipped": report.skipped}
        print_json({**values, "failed": failed, "whole": report.is_whole})
        return
    kept = f" ({report.skipped} were there)" if report.skipped else ""
    lines = [
        f"{out}  {report.images:,} images in {report.shards:,} shards{kept}  {report.seconds:.1f} s"
        + (f", {rate:.3g} images/s" if rate else "")
    ]
    lines += [f"left out: image {one.number}: {one.reason}" for one in report.failed]
    if not report.is_whole:
        lines.append("shards of other parts are missing still: index and datasheet come with the last one")
    print_lines(*lines)


def _dry_run(spec: Spec, adapter: str, sheet: Path, as_json: bool) -> int:
    from dermis.apps.batch.preview import dry_run, table_lines
    from dermis.images.io import check_output, write_png

    check_output(sheet)
    if sheet.suffix.lower() != ".png":
        refuse(sheet, "a name that ends in .png", "it does not", "Name the contact sheet, or leave -o out")
    with working_on("drawing a contact sheet"):
        rows, picture = dry_run(spec, adapter)
    write_png(sheet, picture)
    report = {"sheet": str(sheet), "parameters": rows}
    print_report(as_json, report, lambda: [*table_lines(rows), str(sheet)])
    return 0


_LOG_INTERVAL_S = 30.0  # between lines of a log
_RATE_WINDOW_S = 60.0  # that the rate is taken over


@contextmanager
def image_progress() -> Iterator[Callable[[int, int], None]]:
    """Yield a function that takes how many images are done, of how many."""
    if not sys.stderr.isatty():
        yield ProgressLog(note).tell
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("drawing images"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    with Progress(*columns, console=Console(stderr=True), speed_estimate_period=_RATE_WINDOW_S) as bar:
        task = bar.add_task("", rate="", total=None)
        pace = ImageRate()

        def tell(done: int, of: int) -> None:
            bar.update(task, completed=done, total=of, rate=f"{pace.at(done):.3g} images/s")

        yield tell


class ImageRate:
    """Images a second over the last minute.

    clock : seconds
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._seen = deque([(clock(), 0)])

    def at(self, done: int) -> float:
        """The pace with so many images done by now."""
        now = self._clock()
        self._seen.append((now, done))
        while len(self._seen) > 2 and now - self._seen[1][0] >= _RATE_WINDOW_S:
            self._seen.popleft()
        began, before = self._seen[0]
        return (done - before) / (now - began) if now > began else 0.0


class ProgressLog:
    """A line every half minute, for logs.

    write : takes a line
    """

    def __init__(self, write: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> None:
        self._write, self._clock = write, clock
        self._pace, self._last = ImageRate(clock), clock()

    def tell(self, done: int, of: int) -> None:
        """So many images are done."""
        pace, now = self._pace.at(done), self._clock()
        if now - self._last < _LOG_INTERVAL_S:
            return
        self._last = now
        left = f"{(of - done) / pace / 60:.0f} min left" if pace else "no time known"
        self._write(f"{done:,} of {of:,} images, {pace:.3g} images/s, {left}")
