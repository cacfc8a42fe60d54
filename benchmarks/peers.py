"""Ours against Cycles and Mitsuba: the same head, lights, camera and CPU, in one run, at stated error.

DERMIS_BLENDER_PYTHON=blender/bin/python python benchmarks/peers.py

About twelve minutes on two idle cores; --quick takes one or two. Needs the sample data, Mitsuba, and for
Cycles a Python that has bpy. Times differ from run to run, images do not.
"""

from __future__ import annotations

import json
import os
import platform
import sys
from dataclasses import asdict, replace
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter, run
from peers_figures import figures
from peers_measured import METHODS, Measured, Plan, measure
from peers_page import place_text, scene_text

import dermis
from dermis.apps.truths.blender_process import blender_python
from dermis.apps.truths.mitsuba_scene import load_mitsuba
from dermis.apps.validation.comparisons.scenes import LIGHTS as SCENES
from dermis.base.atomic_write import check_output, replacing
from dermis.base.console import note, print_lines, progress
from dermis.base.errors import DermisError, refuse

ROOT = Path(__file__).resolve().parent
RESULTS = ROOT / "results" / "peers.json"
PAGE = ROOT.parent / "docs" / "peers.md"
LIGHTS = ("front", "back")
QUICK = Plan(side=160, samples=(4, 16), paths=16, frames=3)


def main(
    *,
    head: str = "lee_perry_smith",
    lights: str = ",".join(LIGHTS),
    quick: Annotated[bool, Parameter(negative="")] = False,
    side: int | None = None,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    adapter: str = "cpu",
) -> int:
    """Measure, print Markdown, and write the raw figures.

    Parameters
    ----------
    head:
        Sample or file.
    lights:
        Of front, back and laser, with commas.
    quick:
        A small image with few paths, to see that everything works. Nothing is kept but what -o names.
    side:
        Of the images, in pixels [512; 160 with --quick].
    output:
        JSON with the raw figures [benchmarks/results/peers.json, and docs/peers.md beside it].
    adapter:
        Ours runs on: cpu, so that all have the same machine.
    """
    try:
        target = output or (None if quick else RESULTS)
        if target is not None:
            target.parent.mkdir(parents=True, exist_ok=True)
            check_output(target, (".json",), "Choose such a name")
        plan = QUICK if quick else Plan()
        plan = plan if side is None else replace(plan, side=side)
        report = compare_peers(head, lights.split(","), plan, adapter)
    except DermisError as fault:
        note(f"peers: {fault}")
        return 2
    if target is not None:
        with replacing(target) as unfinished:
            unfinished.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    if target == RESULTS:
        write_page(report)
    print_lines(place_text(report), "", scenes_text(report))
    return 0


def compare_peers(head: str, lights: list[str], plan: Plan, adapter: str) -> dict[str, Any]:
    """The whole report, ready for JSON.

    Without Cycles its rows are left out.

    Raises DermisError for unknown lights, and without Mitsuba, which gives the truth.
    """
    for light in lights:
        if light not in SCENES:
            refuse("--lights", f"names of {', '.join(SCENES)} with commas", f"{light!r} came", "Correct it")
    load_mitsuba()
    try:
        blender_python()
    except DermisError as fault:
        note(f"Cycles is left out. {fault}")
    loaded, renderer = dermis.load_head(head, subdivide=0), dermis.Renderer(adapter)
    scenes: list[Measured] = []
    with progress("measuring") as bar:
        done = 0

        def report(work: int) -> None:
            nonlocal done
            done += work
            bar(done, len(lights) * plan.work)

        scenes = [measure(loaded, light, plan, renderer, report) for light in lights]
    return {
        "date": date.today().isoformat(),
        "head": head,
        "cpu": cpu_model(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "adapter": renderer.device.adapter.name,
        "versions": versions(scenes),
        "denoising": False,
        "plan": asdict(plan),
        "scenes": [figures(one) for one in scenes],
    }


def versions(scenes: list[Measured]) -> dict[str, str]:
    """Of everything that renders, and Python's."""
    found = {name: version(name) for name in ("dermis", "wgpu", "mitsuba", "numpy")}
    passes = [
        turns[0][0] for one in scenes for method in METHODS for turns in [one.cycles.get(method)] if turns
    ]
    if passes:
        found["Blender"] = passes[0].version
    return found | {"Python": platform.python_version()}


def cpu_model() -> str:
    """The processor's name where the system tells it, else its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def write_page(report: dict[str, Any]) -> None:
    """docs/peers.md from its text and the figures."""
    text = PAGE.with_suffix(".in.md").read_text(encoding="utf-8")
    filled = text.format(place=place_text(report), scenes=scenes_text(report))
    with replacing(PAGE) as unfinished:
        unfinished.write_text(filled, encoding="utf-8")


def scenes_text(report: dict[str, Any]) -> str:
    """A section for each light."""
    return "\n\n".join(f"## {told['light'].capitalize()}\n\n{scene_text(told)}" for told in report["scenes"])


if __name__ == "__main__":
    sys.exit(run(main))
