"""How fast data sets are drawn: -o benchmarks/results/scale_NAME.json

On any machine: new people and one person moving, by one worker and by several, and by those of dask. All
numbers of a file are of one run; ratios among them are what to go by on a machine that others use too.
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
from dermis.base.console import note, print_lines
from dermis.base.errors import DermisError
from dermis.base.extras import import_extra
from dermis.cli.options import parse_size
from dermis.frame.renderer import Renderer

OUTPUTS, LANDMARKS = ("depth", "normal", "label"), ("ibug-68",)
_FROM, _TO = 0.25, 0.9  # of the images: processes that start, and those that have nothing left, lie beyond
_STILL = {"light": {"kind": "studio"}, "environment": {"name": "none"}, "background": {"kind": "gradient"}}
_DISK_BYTES = 1 << 28
_MOST_STEPS = 40
_SHARDS = 10  # of each worker, where only whole shards are told of
MARKS = 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000
"""Images of a worker after which its memory is read."""


@dataclass(frozen=True)
class Plan:
    """What is measured on, and how long.

    images : of each run, for one worker
    out : folder on the disk that is meant; a temporary one where None
    """

    adapter: str = "auto"
    size: tuple[int, int] = (512, 512)
    atlas: int = 1024
    images: int = 400
    encoders: int | None = None
    out: Path | None = None


def spec_for(plan: Plan, images: int, shards: int, *, moving: bool = False) -> Spec:
    """The example's people, faces, light and cameras; or one person, moving in one light."""
    tables: JsonObject = tomllib.loads(example_toml())
    tables |= {"count": images, "size": list(plan.size), "shard_size": max(1, images // shards)}
    tables |= {"outputs": list(OUTPUTS), "landmarks": list(LANDMARKS)}
    tables["render"] = {**tables["render"], "atlas": plan.atlas, "shadow_size": plan.atlas}
    if moving:
        tables |= {"images_per_person": images, **_STILL}
        tables.pop("correlated", None)
    return parse_spec(tables)


@dataclass
class Clock:
    """When images were there, and how much memory the workers had.

    resident : bytes of the largest worker after so many images of each, about
    """

    seen: list[tuple[float, int]] = field(default_factory=list)
    memory: list[int] = field(default_factory=list)
    workers: int = 1
    resident: dict[int, int] = field(default_factory=dict)

    def told(self, progress: Progress) -> None:
        self.seen.append((time.monotonic(), progress.images))
        for mark in MARKS:
            if mark not in self.resident and progress.images >= mark * self.workers:
                self.resident[mark] = max((_resident(one.pid) for one in active_children()), default=0)
        share = progress.images / progress.total
        if (len(self.memory) == 0 and share >= _FROM) or (len(self.memory) == 1 and share >= _TO):
            self.memory.append(max((_resident(one.pid) for one in active_children()), default=0))

    def rate(self) -> float:
        """Images/s in between."""
        total = self.seen[-1][1]
        (began, first), *_ = [one for one in self.seen if one[1] >= _FROM * total]
        *_, (ended, last) = [one for one in self.seen if one[1] <= max(_TO * total, first + 1)]
        return (last - first) / (ended - began) if ended > began else 0.0


def measured_run(plan: Plan, pool: WorkerPool, spec: Spec, encoders: int, count: int = 1) -> JsonObject:
    """Images/s of a run, bytes of an image, and memory of a worker at its begin and end [byte]."""
    clock, began = Clock(workers=count), time.monotonic()
    with _folder(plan) as out:
        report = run_batch(RunOptions(spec, out, encoders), pool, on_progress=clock.told)
        size = sum(path.stat().st_size for path in out.rglob("shard-*") if path.is_file())
    return {
        "images": report.images,
        "images_per_s": clock.rate(),
        "seconds": time.monotonic() - began,
        "bytes_per_image": size / max(report.images, 1),
        "worker_bytes": clock.memory,
        "resident_bytes": {str(mark): size for mark, size in clock.resident.items()},
    }


def workers(plan: Plan, count: int, *, moving: bool = False) -> JsonObject:
    """Plain processes, so many of them."""
    slots, encoders = SlotRequest(plan.adapter, workers=count, encoders=plan.encoders).slots()
    spec = spec_for(plan, plan.images * count, 2 * count, moving=moving)
    found = measured_run(plan, ProcessPool(slots), spec, encoders, count)
    return {"workers": count, "encoders": encoders, "adapters": len({one.adapter for one in slots}), **found}


def dask(plan: Plan, count: int) -> JsonObject:
    """The same work by plain processes and by as many workers of dask, each timed by whole shards."""
    distributed = import_extra("distributed", "the comparison with dask")
    slots, encoders = SlotRequest(plan.adapter, workers=count, encoders=plan.encoders).slots()
    spec = spec_for(plan, plan.images * count, _SHARDS * count)
    threads = {"LP_NUM_THREADS": str(slots[0].threads)} if slots[0].threads else {}
    plain = measured_run(plan, ProcessPool(slots), spec, encoders)
    quiet = {"distributed.worker.profile.enabled": False}  # as docs/batch.md says
    with (
        _environment(threads),
        import_extra("dask", "the comparison with dask").config.set(quiet),
        distributed.LocalCluster(
            count,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            memory_limit=0,  # of its own dask pauses workers at a share of what the machine had at first
        ) as made,
    ):
        there = measured_run(plan, DaskCluster(made.scheduler_address, None, plan.adapter), spec, encoders)
    rates = plain["images_per_s"], there["images_per_s"]
    return {"workers": count, "plain": rates[0], "dask": rates[1], "dask_over_plain": rates[1] / rates[0]}


def steps(plan: Plan) -> JsonObject:
    """Milliseconds of each step of an image by itself, in one process: medians."""
    spec = spec_for(plan, min(_MOST_STEPS, plan.images), 1)
    maker, renderer = SceneBuilder(spec), Renderer(plan.adapter, cache_ttl=16)
    told: dict[str, list[float]] = {}
    for number in range(spec.count):
        parameters = _timed(told, "parameters", lambda: spec.parameters(number))  # noqa: B023
        scene, settings = _timed(told, "scene", lambda: maker.build(parameters))  # noqa: B023

        def seen(scene: Any = scene, settings: Any = settings) -> Any:
            return next(renderer.observe([scene], settings, outputs=spec.outputs, landmarks=spec.landmarks))

        observation = _timed(told, "draw_and_read", seen)
        _timed(told, "encode", lambda: encode_record(number, observation, parameters, spec))  # noqa: B023
    return {name: median(times[2:]) for name, times in told.items()}  # the first ones fill caches


def disk(plan: Plan) -> JsonObject:
    """Bytes/s that a file takes, to the disk itself."""
    block = os.urandom(1 << 24)
    with _folder(plan) as out:
        began = time.perf_counter()
        with (out / "trial").open("wb") as file:
            for _ in range(_DISK_BYTES // len(block)):
                file.write(block)
            os.fsync(file.fileno())
        return {"bytes_per_s": _DISK_BYTES / (time.perf_counter() - began)}


def machine_of(plan: Plan) -> JsonObject:
    """What all of it is measured on."""
    adapters = SlotRequest(plan.adapter).adapters()
    return {
        "adapters": [one.name for one in adapters],
        "is_software": adapters[0].kind == "CPU",
        "cores": available_cores(),
        "size": list(plan.size),
        "atlas": plan.atlas,
        "outputs": list(OUTPUTS),
        "landmarks": list(LANDMARKS),
    }


def _timed(told: dict[str, list[float]], name: str, job: Callable[[], Any]) -> Any:
    began = time.perf_counter()
    found = job()
    told.setdefault(name, []).append(1e3 * (time.perf_counter() - began))
    return found


def _resident(pid: int | None) -> int:
    """Bytes of memory that a process holds; 0 where that is not told."""
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
    """Variables that processes started meanwhile see."""
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
        JSON to write.
    adapter:
        As of `dermis batch`.
    size:
        Of the images.
    atlas:
        Texels along its side.
    images:
        For each worker of each run; more give steadier numbers.
    workers:
        How many of them, in all, one run after the other.
    encoders:
        Of each worker [by the number of cores].
    parts:
        Names of steps, new, moving, dask and disk, separated by commas.
    disk:
        Folder on the disk that is meant [the system's temporary one].
    """
    target = check_output(output, (".json",), "Choose such a name")
    plan = Plan(adapter, parse_size(size), atlas, images, encoders, disk)
    counts = [int(one) for one in workers.split(",")]
    told = measure(plan, counts, parts.split(","), lambda told: write_results(target, told, _DIGITS))
    print_lines(*table(told))
    return 0


def measure(
    plan: Plan, counts: list[int], parts: list[str], keep: Callable[[JsonObject], None]
) -> JsonObject:
    """All figures; `keep` gets those known so far after each part."""
    told: JsonObject = {"machine": machine_of(plan), **_about()}
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
        note(part)
        told[part] = jobs[part]()
        keep(told)
    return told


def table(told: JsonObject) -> list[str]:
    """Lines for people."""
    machine = told["machine"]
    lines = [
        f"{', '.join(machine['adapters'])}, {machine['cores']} cores, "
        f"{machine['size'][0]}x{machine['size'][1]}, atlas {machine['atlas']}, load before {told['load']}"
    ]
    for name in ("new", "moving"):
        runs = told.get(name, [])
        for one in runs:
            ratio = one["images_per_s"] / runs[0]["images_per_s"]
            who = f"{one['workers']:3} workers on {one['adapters']} adapters, {one['encoders']} encoders each"
            rate = f"{one['images_per_s']:9.3g} images/s, {ratio:.2f} x the first"
            lines.append(f"{name:8}{who}{rate}, {one['bytes_per_image'] / 1e3:.0f} kB an image")
    if dask := told.get("dask"):
        lines.append(f"dask    {dask['workers']:3} workers: {dask['dask_over_plain']:.3f} x plain processes")
    if steps := told.get("steps"):
        lines.append("alone   " + ", ".join(f"{name} {ms:.3g} ms" for name, ms in steps.items()))
    if disk := told.get("disk"):
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
