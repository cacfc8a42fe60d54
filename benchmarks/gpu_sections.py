"""What is measured on a GPU besides `dermis bench`: lights, options, image sequences, lobes, a cold start."""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any

from other_program import lasted_s

from dermis.apps.validation.benchmarks.cases import FRAGMENTS, PRESETS, Case, scenes_of
from dermis.apps.validation.benchmarks.lobe_cost import lobe_cost_ns
from dermis.apps.validation.benchmarks.measure import Effort, row_ms, stage_ms
from dermis.apps.validation.benchmarks.report import as_json
from dermis.apps.validation.benchmarks.run import run
from dermis.base.console import note
from dermis.base.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.images.writer import ImageWriter
from dermis.mesh.head import Head
from dermis.scene.environment import Environment
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES

ENVIRONMENTS: dict[str, tuple[bool, str | None]] = {
    "studio": (True, None),
    "studio in lebombo": (True, "lebombo"),
    "royal_esplanade": (False, "royal_esplanade"),
}
"""Whether the studio's lights are on, and the panorama."""
OPTIONS: dict[str, dict[str, Any]] = {
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
    """What is measured, and how large it is.

    head : sample or file
    usual : frame for lights and options
    cases, film : frames of `dermis bench`
    effort : for lights and options
    images, image : number in a sequence, and their settings
    viewer : options of `benchmarks/viewer.py`
    """

    adapter: str
    head: str
    usual: Case
    cases: list[Case]
    film: list[Case]
    effort: Effort
    images: int
    image: dict[str, Any]
    viewer: tuple[str, ...] = ()


def plan_of(adapter: str, head: str) -> Plan:
    """The sizes of the documentation's tables."""
    film = PRESETS["film"]
    usual, *others = film.cases()
    largest = [
        case for case in others if case.technique == FRAGMENTS or case.subdivide == max(film.subdivide)
    ]
    settings = {"size": (512, 512), "atlas": 1024}
    interactive = PRESETS["interactive"]
    return Plan(
        adapter, head, interactive.usual, interactive.cases(), [usual, *largest], Effort(), 500, settings
    )


def quick_plan(adapter: str, head: str) -> Plan:
    """Sizes that any machine renders in a moment."""
    usual = Case((48, 32), atlas=64, gaussians=2, lights=1, samples=1)
    cases = [usual, replace(usual, technique=FRAGMENTS, varies="technique")]
    effort = Effort(warming=0, between=0, timed=1, row=1)
    image = {"size": (32, 32), "atlas": 64}
    small = ("--size", "240x160", "--atlas", "64", "--frames", "2")
    return Plan(adapter, head, usual, cases, cases[:1], effort, 4, image, small)


def bench(plan: Plan, head: Head, renderer: Renderer) -> Any:
    """`dermis bench`: all sizes and the passes of 2007."""
    return as_json(run(plan.cases, plan.head, plan.adapter))


def film(plan: Plan, head: Head, renderer: Renderer) -> Any:
    """Frames for film: the usual one, by the fragments of 2007, and with most triangles."""
    return as_json(run(plan.film, plan.head, plan.adapter))


def lights(plan: Plan, head: Head, renderer: Renderer) -> Any:
    """Device time of each stage [ms] under lamps, in a room, and in the sun."""
    settings, found = _settings(plan.usual), {}
    for name, (lamps, panorama) in ENVIRONMENTS.items():
        around = Environment(name=panorama) if panorama else None
        scenes = [
            replace(scene, environment=around, lights=scene.lights if lamps else ())
            for scene in _scenes(plan.usual, head, plan.effort.row)
        ]
        found[name] = _or_reason(partial(_stages, renderer, scenes, settings, plan.effort))
    return found


def options(plan: Plan, head: Head, renderer: Renderer) -> Any:
    """Device time of each stage [ms] by technique and remedy."""
    scenes, found = _scenes(plan.usual, head, plan.effort.row), {}
    for name, chosen in OPTIONS.items():
        settings = Settings(**(_settings(plan.usual).model_dump() | chosen))
        found[name] = _or_reason(partial(_stages, renderer, scenes, settings, plan.effort))
    return found


def sequences(plan: Plan, head: Head, renderer: Renderer) -> Any:
    """Images per second, each with its own camera and lights: as arrays, PNG files and EXR files."""
    scenes = _scenes(replace(plan.usual, lights=1), head, plan.images)

    def bytes_of() -> Iterable[Any]:
        return renderer.render_many(scenes, **plan.image)

    def floats_of() -> Iterable[Any]:
        return renderer.render_many(scenes, linear=True, **plan.image)

    ways = {"bytes": (bytes_of, ""), "floats": (floats_of, ""), "png": (bytes_of, ".png")}
    ways["exr"] = floats_of, ".exr"
    for _ in renderer.render_many(scenes[: plan.effort.row], **plan.image):
        pass
    rates = {name: plan.images / _drained(images(), suffix) for name, (images, suffix) in ways.items()}
    return {"images": plan.images, **plan.image, "threads": os.cpu_count(), "per_second": rates}


def lobes(plan: Plan, head: Head, renderer: Renderer) -> Any:
    """An evaluation of each surface lobe [ns]."""
    return {", ".join(names): ns for names, ns in lobe_cost_ns(renderer.device).items()}


def start(plan: Plan, head: Head, renderer: Renderer) -> Any:
    """Time of a process that renders one image [s]; the second one finds everything in the disk cache."""
    size = "x".join(map(str, plan.image["size"]))
    with tempfile.TemporaryDirectory() as folder:
        image = str(Path(folder) / "image.png")
        words = ["render", plan.head, "--adapter", plan.adapter, "-o", image]
        words += ["--size", size, "--atlas", str(plan.image["atlas"])]
        return {name: lasted_s([sys.executable, "-m", "dermis", *words]) for name in ("first", "second")}


def viewer(plan: Plan, head: Head, renderer: Renderer) -> Any:
    """`benchmarks/viewer.py` without its long memory test; partial results when it ends early."""
    with tempfile.TemporaryDirectory() as folder:
        told = Path(folder) / "viewer.json"
        words = ["--head", plan.head, "--adapter", plan.adapter, "--output", str(told)]
        words += ["--minutes", "0", "--changes", "0", "--seconds", str(_VIEWER_S), *plan.viewer]
        script = str(Path(__file__).with_name("viewer.py"))
        reason = {}
        try:
            lasted_s([sys.executable, script, *words], _VIEWER_S + _LATE_S)
        except DermisError as fault:
            if not told.exists():
                raise
            note(str(fault))
            reason = {"ended": str(fault)}
        return json.loads(told.read_text(encoding="utf-8")) | reason


def _settings(case: Case) -> Settings:
    return Settings(size=case.image, atlas=case.atlas, samples=case.samples)


def _scenes(case: Case, head: Head, count: int) -> list[Scene]:
    """Moving scenes with a profile named rather than in a file, because they outlive the folder."""
    with tempfile.TemporaryDirectory() as folder:
        moving = scenes_of(case, head, Path(folder), max(2, count))
    return [replace(scene, skin=scene.skin.model_copy(update={"profile": "gpu-gems-3"})) for scene in moving]


def _stages(renderer: Renderer, scenes: list[Scene], settings: Settings, effort: Effort) -> dict[str, float]:
    moving = cycle(scenes)
    row_ms(renderer, moving, 1 + effort.warming, settings)
    return stage_ms(renderer, moving, settings, effort)


def _or_reason(measured: Callable[[], Any]) -> Any:
    """The measurements, or why there are none."""
    try:
        return measured()
    except DermisError as fault:
        return {"left_out": str(fault)}


def _drained(images: Iterable[Any], suffix: str) -> float:
    """Time to consume all images, and to write them where there is a suffix [s]."""
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, ImageWriter() as writer:
        for number, image in enumerate(images):
            if suffix:
                writer.write(Path(folder) / f"{number}{suffix}", image)
        writer.finish()
        return time.perf_counter() - started
