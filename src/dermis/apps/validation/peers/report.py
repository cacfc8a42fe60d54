"""Report on the comparison with other renderers: command, JSON results and Markdown."""

from __future__ import annotations

import os
import platform
from dataclasses import asdict, replace
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

import dermis
from dermis.apps.truths.blender_process import blender_python
from dermis.apps.truths.mitsuba_scene import load_mitsuba
from dermis.apps.validation.comparisons.scenes import LIGHTS as SCENES
from dermis.apps.validation.pages import DOCS, RESULTS, JsonObject, fill_page, write_results
from dermis.apps.validation.peers.figures import scene_results
from dermis.apps.validation.peers.rendering import ComparisonSettings, SceneRenders, render_with_all_renderers
from dermis.base.atomic_write import check_output
from dermis.base.console import print_lines, print_note, progress_bar
from dermis.base.errors import DermisError, refuse

RESULTS_FILE, PAGE = RESULTS / "peers.json", DOCS / "peers.md"
DEFAULT_LIGHTS = ("front", "back")
QUICK_SETTINGS = ComparisonSettings(side=160, samples=(4, 16), paths=16, frames=3)
TARGET_TIME_RATIO = 50.0
"""Goal for the time of Cycles, relative to a frame of dermis with the same error [-]."""
_COLUMN_TITLES = ("renderer", "", "seconds", "noise", "relative RMSE", "energy ratio")


def write_peer_report(
    *,
    head: str = "lee_perry_smith",
    lights: str = ",".join(DEFAULT_LIGHTS),
    quick: Annotated[bool, Parameter(negative="")] = False,
    side: int | None = None,
    output: Annotated[Path | None, Parameter(name=("--output", "-o"))] = None,
    adapter: str = "cpu",
) -> None:
    """Measure all renderers, print Markdown, and write the results and docs/peers.md.

    Parameters
    ----------
    head:
        Name of a sample head, or a file.
    lights:
        Names of lights, separated by commas: front, back or laser.
    quick:
        Render a small image with few paths, to check that everything works. Writes only the file of -o.
    side:
        Side of the images [pixel; 512, or 160 with --quick].
    output:
        JSON file of the results [benchmarks/results/peers.json]. With another file, docs/peers.md is not
        written.
    adapter:
        Adapter of dermis: cpu, so that all renderers use the same processor.
    """
    target = output or (None if quick else RESULTS_FILE)
    if target is not None:
        target.parent.mkdir(parents=True, exist_ok=True)
        check_output(target, (".json",), "Choose such a name")
    comparison_settings = QUICK_SETTINGS if quick else ComparisonSettings()
    comparison_settings = comparison_settings if side is None else replace(comparison_settings, side=side)
    report = compare_renderers(head, lights.split(","), comparison_settings, adapter)
    machine, scenes = machine_text(report), scenes_text(report)
    if target is not None:
        write_results(target, report)
    if target == RESULTS_FILE:
        fill_page(PAGE, machine=machine, scenes=scenes)
    print_lines(machine, "", scenes)


def compare_renderers(
    head: str, lights: list[str], comparison_settings: ComparisonSettings, adapter: str
) -> JsonObject:
    """Render and compare all scenes, and return the report as a JSON object.

    If Cycles cannot run, its rows are missing.

    Raises DermisError for unknown lights, or if Mitsuba, which renders the reference, is not installed.
    """
    for light in lights:
        if light not in SCENES:
            refuse("--lights", f"names of {', '.join(SCENES)} with commas", f"got {light!r}", "Correct it")
    load_mitsuba()
    try:
        blender_python()
    except DermisError as fault:
        print_note(f"Cycles is skipped. {fault}")
    loaded, renderer = dermis.load_head(head, subdivide=0), dermis.Renderer(adapter)
    scenes: list[SceneRenders] = []
    with progress_bar("measuring") as bar:
        done = 0

        def advance_progress(step_count: int) -> None:
            nonlocal done
            done += step_count
            bar(done, len(lights) * comparison_settings.progress_steps)

        scenes = [
            render_with_all_renderers(loaded, light, comparison_settings, renderer, advance_progress)
            for light in lights
        ]
    return {
        "date": date.today().isoformat(),
        "head": head,
        "cpu": cpu_model(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "adapter": renderer.device.adapter.name,
        "versions": software_versions(scenes),
        "denoising": False,
        "plan": asdict(comparison_settings),
        "scenes": [scene_results(one) for one in scenes],
    }


def software_versions(scene_renders: list[SceneRenders]) -> dict[str, str]:
    """Return the versions of Python, NumPy and all renderers, by name."""
    versions = {name: version(name) for name in ("dermis", "wgpu", "mitsuba", "numpy")}
    passes = [turns[0][0] for one in scene_renders for turns in one.cycles.values() if turns]
    if passes:
        versions["Blender"] = passes[0].version
    return versions | {"Python": platform.python_version()}


def cpu_model() -> str:
    """Return the name of the processor if the system provides it, or its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def scenes_text(report: JsonObject) -> str:
    """Return Markdown sections, one for the scene under each light."""
    sections = (f"## {one['light'].capitalize()}\n\n{scene_text(one)}" for one in report["scenes"])
    return "\n\n".join(sections)


def scene_text(scene_report: JsonObject) -> str:
    """Return a Markdown table of the renderers in one scene, and sentences about it."""
    head = f"| {' | '.join(_COLUMN_TITLES)} |\n|{'---|' * len(_COLUMN_TITLES)}"
    table = [head, *(_table_line(row) for row in scene_report["rows"])]
    return "\n".join([*table, "", *(f"- {sentence}" for sentence in _scene_sentences(scene_report))])


def machine_text(report: JsonObject) -> str:
    """Return the date, the machine and the software versions of a measurement in one line."""
    versions = ", ".join(f"{name} {version}" for name, version in report["versions"].items())
    side = report["plan"]["side"]
    machine = f"{report['cpu']}, {report['cores']} cores; ours on {report['adapter']}"
    return f"{report['date']}, {side}x{side}, {machine}; {versions}"


def _table_line(renderer_row: JsonObject) -> str:
    seconds = "-" if renderer_row["seconds"] is None else f"{renderer_row['seconds']:.3g}"
    noise = f"{renderer_row['noise']:.1%}" if renderer_row["noise"] > 0 else "-"
    cells = renderer_row["renderer"], renderer_row["setting"], seconds, noise
    errors = [_error_cell(renderer_row, name) for name in ("relrmse", "energy_ratio")]
    return f"| {' | '.join((*cells, *errors))} |"


def _error_cell(renderer_row: JsonObject, error_name: str) -> str:
    return (
        "-"
        if renderer_row[error_name] is None
        else f"{renderer_row[error_name]:.4f} ± {renderer_row[error_name + '_se']:.4f}"
    )


def _scene_sentences(scene_report: JsonObject) -> list[str]:
    sentences = [
        _random_walk_sentence(setting, times) for setting, times in scene_report.get("as_near", {}).items()
    ]
    corrected = "; ".join(
        f"{name} {error:.3f}" for name, error in scene_report["ours_energy_put_right"].items()
    )
    sentences.append(f"Ours, each channel scaled to the reference's energy: {corrected}.")
    sentences += [
        f"The {name} take {ratio['ratio']:.2f} times as long as the first of ours, "
        f"{ratio['core_ratio']:.2f} times in CPU time."
        for name, ratio in scene_report.get("published", {}).items()
    ]
    if "burley_against_random_walk" in scene_report:
        sentences.append(_burley_sentence(scene_report))
    return sentences + [f"Skipped: {name}. {reason}" for name, reason in scene_report["left_out"].items()]


def _random_walk_sentence(dermis_setting: str, cycles_times: dict[str, dict[str, float]]) -> str:
    walk, clean = (
        f"{dermis_setting}: Cycles' random walk",
        f"noise of 5 % takes {_cost_text(cycles_times['clean'])}",
    )
    if "same_error" not in cycles_times:
        return f"{walk} never has as small an error, because its bias is larger; {clean}."
    same = cycles_times["same_error"]
    reached = "reached" if same["ratio"] >= TARGET_TIME_RATIO else "not reached"
    goal = f"goal {TARGET_TIME_RATIO:.0f} {reached}"
    return f"{walk} has the same error after {_cost_text(same)}, {goal}; {clean}."


def _cost_text(cycles_times: dict[str, float]) -> str:
    """Return text with the number of paths and the time of Cycles, and the ratio to the time of dermis."""
    elapsed, cpu = (_time_ratio_text(cycles_times[name]) for name in ("ratio", "core_ratio"))
    cost = f"{cycles_times['seconds']:.3g} s ({cycles_times['samples']:.0f} paths per pixel)"
    return f"{cost}: {elapsed} times our frame, {cpu} in CPU time"


def _time_ratio_text(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.1f}"


def _burley_sentence(scene_report: JsonObject) -> str:
    """Return a sentence that compares the error of Burley's profile with that of dermis.

    The error of Burley's profile in Cycles is relative to a random walk in Cycles. The error of dermis is
    relative to path tracing by Mitsuba.
    """
    burley_error, error = scene_report["burley_against_random_walk"]
    verdicts = []
    for row in scene_report["rows"]:
        if row["setting"] in scene_report["ours_energy_put_right"]:
            reached = "reached" if row["relrmse"] <= burley_error else "not reached"
            verdicts.append(f"{row['setting']} {row['relrmse']:.4f}, {reached}")
    return (
        f"The error of Burley's profile against the random walk is {burley_error:.4f} ± {error:.4f}; "
        f"the goal is that ours against path tracing is no larger: {'; '.join(verdicts)}."
    )
