"""Measure all GPU figures of docs/performance.md.

For a server without a screen; it ends within --minutes. Each part is written as soon as it is measured, so
that an interrupted run loses little. --quick runs all parts at tiny sizes on any adapter.
"""

from __future__ import annotations

import json
import os
import platform
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from itertools import cycle
from pathlib import Path
from typing import IO, Annotated

import numpy as np
from cyclopts import Parameter
from numpy.typing import NDArray

import dermis
from dermis.apps.validation.benchmarks.cases import (
    BENCHMARK_PRESETS,
    FRAGMENT_TECHNIQUE,
    BenchmarkCase,
    case_scenes,
)
from dermis.apps.validation.benchmarks.lobe_cost import lobe_cost_ns
from dermis.apps.validation.benchmarks.measure import FrameCounts, sequence_ms, stage_ms
from dermis.apps.validation.benchmarks.report import benchmark_json
from dermis.apps.validation.benchmarks.run import run_benchmark as run_benchmark
from dermis.apps.validation.pages import JsonObject, write_results
from dermis.base.atomic_write import check_output
from dermis.base.command_line import run_script
from dermis.base.console import print_note
from dermis.base.errors import DermisError
from dermis.formats.samples import is_available
from dermis.frame.renderer import Renderer
from dermis.images.writer import ImageWriter
from dermis.mesh.head import Head
from dermis.scene.environment import Environment
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES

MAX_DURATION_S = 150.0


def run_time_s(words: list[str], longest_s: float = MAX_DURATION_S) -> float:
    """Run a program, forward its standard error, and return its run time [s].

    Raises DermisError with its last output if it failed or took too long.
    """
    started, name = time.perf_counter(), " ".join([Path(words[1]).name, words[2]])
    last: deque[str] = deque(["it said nothing"], maxlen=1)
    with subprocess.Popen(
        words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as program:
        assert program.stderr is not None
        listener = threading.Thread(target=_forward_output, args=(program.stderr, last))
        listener.start()
        try:
            failed = program.wait(longest_s)
        except subprocess.TimeoutExpired as fault:
            actual = f"expected it to end within {longest_s:g} s, but it did not. Last words: {last[0]}"
            raise DermisError(f"{name}: {actual}") from fault
        finally:
            with suppress(ProcessLookupError):  # and its child processes
                os.killpg(program.pid, signal.SIGKILL)
            listener.join()
    if failed:
        raise DermisError(f"{name}: {last[0]}")
    return time.perf_counter() - started


def _forward_output(stream: IO[str], last: deque[str]) -> None:
    for line in stream:
        if line.strip():
            last.append(line.strip())
            print_note(line.rstrip())


ENVIRONMENTS: dict[str, tuple[bool, str | None]] = {
    "studio": (True, None),
    "studio in lebombo": (True, "lebombo"),
    "royal_esplanade": (False, "royal_esplanade"),
}
"""Whether the studio's lights are on, and the panorama."""
OPTIONS: dict[str, JsonObject] = {
    "usual": {},
    "seams alpha": {"seams": "alpha"},
    "seams alpha, stretch axes, transmission none": {
        "seams": "alpha",
        "stretch": "axes",
        "transmission": "none",
    },
    **{name: {"technique": name} for name in TECHNIQUES if name != Settings().technique},
}
_VIEWER_S, _LATE_S = 90.0, 20.0  # time limit of the viewer's benchmark, and how far it may overrun


@dataclass(frozen=True)
class Plan:
    """Extent of the measurements.

    head : sample or file
    base_case : frame for lights and options
    cases, film : frames of `dermis bench` with the presets interactive and film
    effort : frame counts for lights and options
    images, image : number of images in a sequence, and their settings
    viewer : options of `benchmarks/viewer.py`
    """

    adapter: str
    head: str
    base_case: BenchmarkCase
    cases: list[BenchmarkCase]
    film: list[BenchmarkCase]
    effort: FrameCounts
    images: int
    image: JsonObject
    viewer: tuple[str, ...] = ()


def full_plan(adapter: str, head: str) -> Plan:
    """Return the plan with the sizes of the documentation."""
    film = BENCHMARK_PRESETS["film"]
    base_case, *others = film.cases()
    largest = [
        case
        for case in others
        if case.technique == FRAGMENT_TECHNIQUE or case.subdivide == max(film.subdivide)
    ]
    settings = {"size": (512, 512), "atlas": 1024}
    interactive = BENCHMARK_PRESETS["interactive"]
    return Plan(
        adapter,
        head,
        interactive.base_case,
        interactive.cases(),
        [base_case, *largest],
        FrameCounts(),
        500,
        settings,
    )


def quick_plan(adapter: str, head: str) -> Plan:
    """Return a plan with sizes that any machine renders quickly."""
    base_case = BenchmarkCase((48, 32), atlas=64, gaussians=2, lights=1, samples=1)
    cases = [base_case, replace(base_case, technique=FRAGMENT_TECHNIQUE, varies="technique")]
    effort = FrameCounts(warmup=0, between=0, timed=1, sequence=1)
    image = {"size": (32, 32), "atlas": 64}
    small = ("--size", "240x160", "--atlas", "64", "--frames", "2")
    return Plan(adapter, head, base_case, cases, cases[:1], effort, 4, image, small)


def bench(plan: Plan, head: Head, renderer: Renderer) -> JsonObject:
    """Measure the frames of `dermis bench` at all sizes, and the passes of 2007."""
    return benchmark_json(run_benchmark(plan.cases, plan.head, plan.adapter))


def film(plan: Plan, head: Head, renderer: Renderer) -> JsonObject:
    """Measure film frames: the base frame, one with fragment shaders of 2007, and one with most triangles."""
    return benchmark_json(run_benchmark(plan.film, plan.head, plan.adapter))


def lights(plan: Plan, head: Head, renderer: Renderer) -> JsonObject:
    """Return the device time of each stage with lamps, an environment, and the sun [ms]."""
    settings, found = _settings(plan.base_case), {}
    for name, (lamps, panorama) in ENVIRONMENTS.items():
        around = Environment(name=panorama) if panorama else None
        scenes = [
            replace(scene, environment=around, lights=scene.lights if lamps else ())
            for scene in _scenes(plan.base_case, head, plan.effort.sequence)
        ]
        found[name] = _or_reason(partial(_stages, renderer, scenes, settings, plan.effort))
    return found


def options(plan: Plan, head: Head, renderer: Renderer) -> JsonObject:
    """Return the device time of each stage by technique and option [ms]."""
    scenes, found = _scenes(plan.base_case, head, plan.effort.sequence), {}
    for name, chosen in OPTIONS.items():
        settings = Settings(**(_settings(plan.base_case).model_dump() | chosen))
        found[name] = _or_reason(partial(_stages, renderer, scenes, settings, plan.effort))
    return found


def sequences(plan: Plan, head: Head, renderer: Renderer) -> JsonObject:
    """Return images per second with different cameras and lights: as arrays, PNG files and EXR files."""
    scenes = _scenes(replace(plan.base_case, lights=1), head, plan.images)

    def bytes_of() -> Iterable[NDArray[np.generic]]:
        return renderer.render_many(scenes, **plan.image)

    def floats_of() -> Iterable[NDArray[np.generic]]:
        return renderer.render_many(scenes, linear=True, **plan.image)

    ways = {"bytes": (bytes_of, ""), "floats": (floats_of, ""), "png": (bytes_of, ".png")}
    ways["exr"] = floats_of, ".exr"
    for _ in renderer.render_many(scenes[: plan.effort.sequence], **plan.image):
        pass
    rates = {name: plan.images / _consume_s(images(), suffix) for name, (images, suffix) in ways.items()}
    return {"images": plan.images, **plan.image, "threads": os.cpu_count(), "per_second": rates}


def lobes(plan: Plan, head: Head, renderer: Renderer) -> JsonObject:
    """Return the cost per evaluation of each specular lobe [ns]."""
    return {", ".join(names): ns for names, ns in lobe_cost_ns(renderer.device).items()}


def start(plan: Plan, head: Head, renderer: Renderer) -> JsonObject:
    """Return the time of a process that renders one image [s]; the second one uses the disk cache."""
    size = "x".join(map(str, plan.image["size"]))
    with tempfile.TemporaryDirectory() as folder:
        image = str(Path(folder) / "image.png")
        words = ["render", plan.head, "--adapter", plan.adapter, "-o", image]
        words += ["--size", size, "--atlas", str(plan.image["atlas"])]
        return {name: run_time_s([sys.executable, "-m", "dermis", *words]) for name in ("first", "second")}


def viewer(plan: Plan, head: Head, renderer: Renderer) -> JsonObject:
    """Run `benchmarks/viewer.py` without its long memory test; return partial results if it ends early."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "viewer.json"
        words = ["--head", plan.head, "--adapter", plan.adapter, "--output", str(file)]
        words += ["--minutes", "0", "--changes", "0", "--seconds", str(_VIEWER_S), *plan.viewer]
        script = str(Path(__file__).with_name("viewer.py"))
        reason = {}
        try:
            run_time_s([sys.executable, script, *words], _VIEWER_S + _LATE_S)
        except DermisError as fault:
            if not file.exists():
                raise
            print_note(str(fault))
            reason = {"ended": str(fault)}
        figures: JsonObject = json.loads(file.read_text(encoding="utf-8"))
        return figures | reason


def _settings(case: BenchmarkCase) -> Settings:
    return Settings(size=case.image, atlas=case.atlas, samples=case.samples)


def _scenes(case: BenchmarkCase, head: Head, count: int) -> list[Scene]:
    """Return moving scenes with a named profile, because the folder of profile files is deleted."""
    with tempfile.TemporaryDirectory() as folder:
        moving = case_scenes(case, head, Path(folder), max(2, count))
    return [replace(scene, skin=scene.skin.model_copy(update={"profile": "gpu-gems-3"})) for scene in moving]


def _stages(
    renderer: Renderer, scenes: list[Scene], settings: Settings, effort: FrameCounts
) -> dict[str, float]:
    moving = cycle(scenes)
    sequence_ms(renderer, moving, 1 + effort.warmup, settings)
    return stage_ms(renderer, moving, settings, effort)


def _or_reason(measured: Callable[[], JsonObject | float]) -> JsonObject | float:
    """Return the measurements, or the reason why there are none."""
    try:
        return measured()
    except DermisError as fault:
        return {"left_out": str(fault)}


def _consume_s(images: Iterable[NDArray[np.generic]], suffix: str) -> float:
    """Return the time to consume all images, and to write them if a suffix is given [s]."""
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, ImageWriter() as writer:
        for number, image in enumerate(images):
            if suffix:
                writer.write(Path(folder) / f"{number}{suffix}", image)
        writer.finish()
        return time.perf_counter() - started


PARTS = ("bench", "lobes", "sequences", "lights", "options", "start", "viewer", "film")
"""Parts, the most important first; lobes early, before the device is idle and three times as slow."""
_NEEDED_S = {"bench": 0, "film": 120, "viewer": 120}  # duration of a part on a slow server [s]
_DIGITS = 5


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    head: str = "auto",
    adapter: str = "auto",
    parts: str = ",".join(PARTS),
    minutes: float = 8.0,
    quick: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Measure and write the figures.

    Parameters
    ----------
    output:
        JSON file to write.
    head:
        auto (the scan lee_perry_smith if available, else human), a sample or a file.
    adapter:
        auto (the best), cpu (software), or part of an adapter's name.
    parts:
        Names of parts, separated by commas: bench, lobes, sequences, lights, options, start, viewer and film.
    minutes:
        Time limit; parts that would exceed it are not started [min].
    quick:
        Use tiny sizes.
    """
    target = check_output(output, (".json",), "Choose such a name")
    name = ("lee_perry_smith" if is_available("lee_perry_smith") else "human") if head == "auto" else head
    plan = (quick_plan if quick else full_plan)(adapter, name)
    measure(plan, _parse_parts(parts), minutes, lambda figures: write_results(target, figures, _DIGITS))


def measure(plan: Plan, parts: list[str], minutes: float, keep: Callable[[JsonObject], None]) -> JsonObject:
    """Return all figures; after each part, call `keep` with the figures so far."""
    began = time.perf_counter()
    head, renderer = dermis.load_head(plan.head, subdivide=0), dermis.Renderer(plan.adapter)
    figures = _about(plan, renderer)
    for part in parts:
        print_note(part)
        started = time.perf_counter()
        left = 60.0 * minutes - (started - began)
        figures[part] = _measured(part, plan, head, renderer, left)
        figures["seconds"][part] = time.perf_counter() - started
        keep(figures)
    return figures


def _measured(part: str, plan: Plan, head: Head, renderer: Renderer, left: float) -> JsonObject:
    """Return the figures of a part, or the reason why there are none."""
    if left < _NEEDED_S.get(part, 20):
        return {"left_out": f"{left:.0f} s were left"}
    try:
        figures: JsonObject = globals()[part](plan, head, renderer)
        return figures
    except DermisError as fault:
        print_note(f"left out: {fault}")
        return {"left_out": str(fault)}
    finally:
        renderer.clear_cache()  # the next part may need all of the memory


def _about(plan: Plan, renderer: Renderer) -> JsonObject:
    device = renderer.device
    return {
        "head": plan.head,
        "adapter": device.adapter.name,
        "driver": device.adapter.driver,
        "versions": {name: version(name) for name in ("dermis", "wgpu", "numpy")}
        | {"python": platform.python_version()},
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": {},
    }


def _parse_parts(parts: str) -> list[str]:
    names = parts.split(",")
    for name in names:
        if name not in PARTS:
            raise DermisError(f"--parts: expected names of {', '.join(PARTS)}, but got {name!r}. Correct it.")
    return names


if __name__ == "__main__":
    run_script(main)
