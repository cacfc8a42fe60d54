"""Measure the speed of data set rendering.

    python benchmarks/batch.py -o benchmarks/results/scale_NAME.json

Measures new people and one moving person, with one and several local workers and with dask workers. All
figures of a file are of one run; on a shared machine only their ratios are reliable.
"""

from __future__ import annotations

import os
import platform
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from multiprocessing import active_children
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Annotated, Any

from cyclopts import Parameter

from dermis.apps.batch.dask_cluster import DaskCluster
from dermis.apps.batch.records import encode_record
from dermis.apps.batch.run import Progress, WorkerPool
from dermis.apps.batch.run import run as run_batch
from dermis.apps.batch.scenes import SceneBuilder
from dermis.apps.batch.spec import Spec, example_toml, parse_spec
from dermis.apps.batch.worker import RunOptions
from dermis.apps.batch.worker_pool import ProcessPool, SlotRequest, available_cores
from dermis.apps.validation.pages import JsonObject, write_results
from dermis.base.atomic_write import check_output
from dermis.base.command_line import run_script
from dermis.base.console import print_lines, print_note
from dermis.base.errors import DermisError
from dermis.base.extras import import_extra
from dermis.cli.options import parse_size
from dermis.frame.renderer import Renderer

OUTPUTS, LANDMARKS = ("depth", "normal", "label"), ("ibug-68",)
_RATE_BEGIN, _RATE_END = 0.25, 0.9  # part of the images that is timed, without start and end of processes
_SAME_LIGHT = {
    "light": {"kind": "studio"},
    "environment": {"name": "none"},
    "background": {"kind": "gradient"},
}
_DISK_BYTES = 1 << 28
_MOST_STEPS = 40
MEMORY_MARKS = 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000
"""Numbers of images after which the memory of a worker is read."""


@dataclass(frozen=True)
class Plan:
    """Extent of the measurements.

    images : number of images of each run, per worker
    out : folder on the disk to write to and to measure; None for a temporary folder
    """

    adapter: str = "auto"
    size: tuple[int, int] = (512, 512)
    atlas: int = 1024
    images: int = 400
    encoders: int | None = None
    out: Path | None = None


def spec_for(plan: Plan, images: int, *, moving: bool = False) -> Spec:
    """Return the spec of the example with random people, or of one person moving in one light."""
    tables: JsonObject = tomllib.loads(example_toml())
    tables |= {"count": images, "size": list(plan.size)}
    tables |= {"outputs": list(OUTPUTS), "landmarks": list(LANDMARKS)}
    tables["render"] = {**tables["render"], "atlas": plan.atlas, "shadow_size": plan.atlas}
    if moving:
        tables |= {"images_per_person": images, **_SAME_LIGHT}
        tables.pop("correlated", None)
    return parse_spec(tables)


@dataclass
class RunRecorder:
    """Times at which images of a run were finished, and the memory of its workers.

    seen : times [s], each with the number of images finished by then
    memory : resident memory of the largest worker at the begin and the end of the timed part [byte]
    resident : resident memory of the largest worker, by number of images per worker [byte]
    """

    seen: list[tuple[float, int]] = field(default_factory=list)
    memory: list[int] = field(default_factory=list)
    workers: int = 1
    resident: dict[int, int] = field(default_factory=dict)

    def record(self, progress: Progress) -> None:
        """Record the progress of a run."""
        self.seen.append((time.monotonic(), progress.images))
        for mark in MEMORY_MARKS:
            if mark not in self.resident and progress.images >= mark * self.workers:
                self.resident[mark] = max((_resident(one.pid) for one in active_children()), default=0)
        share = progress.images / progress.total
        if (len(self.memory) == 0 and share >= _RATE_BEGIN) or (len(self.memory) == 1 and share >= _RATE_END):
            self.memory.append(max((_resident(one.pid) for one in active_children()), default=0))

    def rate(self) -> float:
        """Return the number of images per second in the timed part of the run."""
        total = self.seen[-1][1]
        (began, first), *_ = [one for one in self.seen if one[1] >= _RATE_BEGIN * total]
        *_, (ended, last) = [one for one in self.seen if one[1] <= max(_RATE_END * total, first + 1)]
        return (last - first) / (ended - began) if ended > began else 0.0


def measured_run(plan: Plan, pool: WorkerPool, spec: Spec, encoders: int, count: int = 1) -> JsonObject:
    """Return images/s, bytes per image, and the memory of a worker at begin and end of a run [byte]."""
    recorder, began = RunRecorder(workers=count), time.monotonic()
    with _folder(plan) as out:
        report = run_batch(RunOptions(spec, out, encoders), pool, on_progress=recorder.record)
        size = sum(path.stat().st_size for path in out.rglob("shard-*") if path.is_file())
    return {
        "images": report.images,
        "images_per_s": recorder.rate(),
        "seconds": time.monotonic() - began,
        "bytes_per_image": size / max(report.images, 1),
        "worker_bytes": recorder.memory,
        "resident_bytes": {str(mark): size for mark, size in recorder.resident.items()},
    }


def workers(plan: Plan, count: int, *, moving: bool = False) -> JsonObject:
    """Measure a run with the given number of local workers."""
    slots, encoders = SlotRequest(plan.adapter, workers=count, encoders=plan.encoders).worker_slots()
    spec = spec_for(plan, plan.images * count, moving=moving)
    found = measured_run(plan, ProcessPool(slots), spec, encoders, count)
    return {"workers": count, "encoders": encoders, "adapters": len({one.adapter for one in slots}), **found}


def dask(plan: Plan, count: int) -> JsonObject:
    """Measure the same run with local processes and with dask workers, and the ratio of their rates."""
    distributed = import_extra("distributed", "the comparison with dask")
    slots, encoders = SlotRequest(plan.adapter, workers=count, encoders=plan.encoders).worker_slots()
    spec = spec_for(plan, plan.images * count)
    threads = {"LP_NUM_THREADS": str(slots[0].threads)} if slots[0].threads else {}
    plain = measured_run(plan, ProcessPool(slots), spec, encoders)
    quiet = {"distributed.worker.profile.enabled": False}  # as docs/batch.md recommends
    with (
        _environment(threads),
        import_extra("dask", "the comparison with dask").config.set(quiet),
        distributed.LocalCluster(
            count,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            memory_limit=0,  # otherwise dask pauses workers at a fraction of the machine's memory
        ) as made,
    ):
        there = measured_run(plan, DaskCluster(made.scheduler_address, None, plan.adapter), spec, encoders)
    rates = plain["images_per_s"], there["images_per_s"]
    return {"workers": count, "plain": rates[0], "dask": rates[1], "dask_over_plain": rates[1] / rates[0]}


def steps(plan: Plan) -> JsonObject:
    """Return the median time of each step that makes an image, in one process [ms]."""
    spec = spec_for(plan, min(_MOST_STEPS, plan.images))
    maker, renderer = SceneBuilder(spec), Renderer(plan.adapter, cache_ttl=16)

    def observe(scene: Any, settings: Any) -> Any:
        return next(renderer.observe([scene], settings, outputs=spec.outputs, landmarks=spec.landmarks))

    times_ms: dict[str, list[float]] = {}
    for number in range(spec.count):
        parameters = _timed(times_ms, "parameters", spec.parameters, number)
        scene, settings = _timed(times_ms, "scene", maker.build, parameters)
        observation = _timed(times_ms, "draw_and_read", observe, scene, settings)
        _timed(times_ms, "encode", encode_record, number, observation, parameters, spec)
    return {name: median(times[2:]) for name, times in times_ms.items()}  # the first images fill caches


def disk(plan: Plan) -> JsonObject:
    """Return the write speed of the disk [byte/s]."""
    block = os.urandom(1 << 24)
    with _folder(plan) as out:
        began = time.perf_counter()
        with (out / "trial").open("wb") as file:
            for _ in range(_DISK_BYTES // len(block)):
                file.write(block)
            os.fsync(file.fileno())
        return {"bytes_per_s": _DISK_BYTES / (time.perf_counter() - began)}


def machine_description(plan: Plan) -> JsonObject:
    """Return the description of the machine."""
    adapters = SlotRequest(plan.adapter).matching_adapters()
    return {
        "adapters": [one.name for one in adapters],
        "is_software": adapters[0].kind == "CPU",
        "cores": available_cores(),
        "size": list(plan.size),
        "atlas": plan.atlas,
        "outputs": list(OUTPUTS),
        "landmarks": list(LANDMARKS),
    }


def _timed(times_ms: dict[str, list[float]], name: str, job: Callable[..., Any], *args: Any) -> Any:
    began = time.perf_counter()
    found = job(*args)
    times_ms.setdefault(name, []).append(1e3 * (time.perf_counter() - began))
    return found


def _resident(pid: int | None) -> int:
    """Return the resident memory of a process [byte]; 0 if unknown."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return 0


@contextmanager
def _folder(plan: Plan) -> Iterator[Path]:
    with TemporaryDirectory(dir=plan.out, prefix="batch-") as made:
        yield Path(made)


@contextmanager
def _environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables for processes started inside the block."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


PARTS = ("steps", "new", "moving", "dask", "disk")
_DIGITS = 4


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    adapter: str = "auto",
    size: str = "512x512",
    atlas: int = 1024,
    images: int = 400,
    workers: str = "1,2,4",
    encoders: int | None = None,
    parts: str = ",".join(PARTS),
    disk: Path | None = None,
) -> int:
    """Measure and write the figures.

    Parameters
    ----------
    output:
        JSON file to write.
    adapter:
        Adapter as for `dermis batch`.
    size:
        Width and height of the images, WIDTHxHEIGHT [pixel].
    atlas:
        Side of the atlas [texel].
    images:
        Number of images per worker of each run; more give steadier figures.
    workers:
        Numbers of workers, one run for each, separated by commas.
    encoders:
        Number of encoders per worker. [default: by the number of cores]
    parts:
        Names of parts to measure, separated by commas: steps, new, moving, dask and disk.
    disk:
        Folder on the disk to measure. [default: the temporary folder of the system]
    """
    target = check_output(output, (".json",), "Choose such a name")
    plan = Plan(adapter, parse_size(size), atlas, images, encoders, disk)
    counts = [int(one) for one in workers.split(",")]
    figures = measure(plan, counts, parts.split(","), lambda figures: write_results(target, figures, _DIGITS))
    print_lines(*table(figures))
    return 0


def measure(
    plan: Plan, counts: list[int], parts: list[str], keep: Callable[[JsonObject], None]
) -> JsonObject:
    """Return all figures; after each part, call `keep` with the figures so far."""
    figures: JsonObject = {"machine": machine_description(plan), **_about()}
    jobs: dict[str, Callable[[], Any]] = {
        "steps": lambda: steps(plan),
        "new": lambda: [workers(plan, count) for count in counts],
        "moving": lambda: [workers(plan, count, moving=True) for count in counts],
        "dask": lambda: dask(plan, counts[-1]),
        "disk": lambda: disk(plan),
    }
    for part in parts:
        if part not in jobs:
            raise DermisError(f"--parts: expected some of {', '.join(PARTS)}, but got {part!r}. Correct it.")
        print_note(part)
        figures[part] = jobs[part]()
        keep(figures)
    return figures


def table(figures: JsonObject) -> list[str]:
    """Return the figures as lines of text."""
    machine = figures["machine"]
    lines = [
        f"{', '.join(machine['adapters'])}, {machine['cores']} cores, "
        f"{machine['size'][0]}x{machine['size'][1]}, atlas {machine['atlas']}, load before {figures['load']}"
    ]
    for name in ("new", "moving"):
        runs = figures.get(name, [])
        for one in runs:
            ratio = one["images_per_s"] / runs[0]["images_per_s"]
            who = f"{one['workers']:3} workers on {one['adapters']} adapters, {one['encoders']} encoders each"
            rate = f"{one['images_per_s']:9.3g} images/s, {ratio:.2f} x the first"
            lines.append(f"{name:8}{who}{rate}, {one['bytes_per_image'] / 1e3:.0f} kB an image")
    if dask := figures.get("dask"):
        lines.append(f"dask    {dask['workers']:3} workers: {dask['dask_over_plain']:.3f} x plain processes")
    if steps := figures.get("steps"):
        lines.append("alone   " + ", ".join(f"{name} {ms:.3g} ms" for name, ms in steps.items()))
    if disk := figures.get("disk"):
        lines.append(f"disk    {disk['bytes_per_s'] / 1e6:.0f} MB/s")
    return lines


def _about() -> JsonObject:
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    versions = {name: version(name) for name in ("dermis", "wgpu", "numpy")}
    return {
        "versions": versions | {"python": platform.python_version()},
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "load": load,
    }


if __name__ == "__main__":
    run_script(main)
