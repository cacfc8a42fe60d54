"""Measure frame rate, latency and memory of the viewer.

No screen is needed: an offscreen canvas replaces the window, and a client with the protocol of the page
replaces the browser. Takes about a quarter of an hour, most of it for memory; --minutes 0.5 --changes 50 is a
quick check, --minutes 0 --changes 0 --seconds 90 skips memory and measures the rest within 90 seconds.
Figures are written as they are measured, with the reason if a section ends early.
"""

from __future__ import annotations

import json
import platform
import resource
from collections.abc import Callable, Iterable
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from viewer_input import Clock, Plan, offscreen, slider_position, speeds
from viewer_memory import delays, memory_samples
from viewer_page import page_figures

from dermis.apps.validation.pages import JsonObject
from dermis.base.atomic_write import atomic_file, check_output
from dermis.base.command_line import run_script
from dermis.base.console import print_lines, print_note
from dermis.cli.options import parse_size
from dermis.gpu import Device, open_device

_SECTIONS = ("speed", "delay", "page", "memory")


def tables(results: JsonObject) -> str:
    """Return all available figures as Markdown tables."""
    parts = [_title(results), _speed(results), _delay(results)]
    if "samples" in results.get("memory", {}):
        parts.append(_memory(results["memory"]))
    ended = [
        f"{name} ended early: {results[name]['ended']}"
        for name in _SECTIONS
        if "ended" in results.get(name, {})
    ]
    return "\n\n".join([*parts, *ended])


def _figures(results: JsonObject, section: str) -> JsonObject:
    """Return the figures of a section, without the reason why it ended early."""
    return {name: one for name, one in results.get(section, {}).items() if name != "ended"}


def _title(results: JsonObject) -> str:
    plan = results["plan"]
    size = " x ".join(map(str, plan["size"]))
    what = f"{plan['head']}, {size}, atlas {plan['atlas']}, samples {plan['samples']}"
    return f"{results['adapter']}, {what}, {results['date'][:10]}"


def _speed(results: JsonObject) -> str:
    rows = [
        "| motion | frames/s | frame [ms] | 95 % within, longest [ms] | processor time [ms] | stages |",
        "|---|---|---|---|---|---|",
    ]
    for name, one in _figures(results, "speed").items():
        numbers = f"{one['frames_per_s']:.1f} | {one['frame_ms']:.1f} | {_late(one)}"
        rows.append(f"| {name} | {numbers} | {one['processor_ms']:.1f} | {', '.join(one['stages'])} |")
    page = _figures(results, "page")
    for name in ("camera", "light", "melanin"):
        if name in page:
            one = page[name]
            numbers = f"{one['frames_per_s']:.1f} | | {_late(one)}"
            rows.append(f"| {name}, in the page | {numbers} | | {one['kilobytes']:.0f} kB a frame |")
    return "\n".join(rows)


def _late(one: dict[str, float]) -> str:
    return f"{one['late_frame_ms']:.1f}, {one['longest_frame_ms']:.1f}"


def _delay(results: JsonObject) -> str:
    rows = ["| latency from a move to the picture | median [ms] | 95 % within [ms] |", "|---|---|---|"]
    page, several = _figures(results, "page"), _figures(results, "delay")
    if "delay" in page:
        several["in the page, from rest"] = page["delay"]
    for name, one in several.items():
        rows.append(f"| {name} | {one['median_ms']:.1f} | {one['late_ms']:.1f} |")
    if "encoding" in page:
        coding = page["encoding"]
        rows.append(
            f"| of which JPEG, and PNG when still | {coding['jpeg_ms']:.1f}, {coding['png_ms']:.1f} | |"
        )
    return "\n".join(rows)


def _memory(memory: JsonObject) -> str:
    taken = memory["samples"]
    size = " x ".join(map(str, memory["plan"]["size"]))
    rows = [
        f"{size}, atlas {memory['plan']['atlas']}:",
        "",
        "| after changes | minutes | process [MB] | textures and buffers [MB] |",
        "|---|---|---|---|",
    ]
    for k in sorted({0, *(round(part * (len(taken) - 1) / 8) for part in range(9))}):
        one = taken[k]
        numbers = f"{one['s'] / 60:.1f} | {one['resident_mb']:.0f} | {one['device_mb']:.1f}"
        rows.append(f"| {one['changes']} | {numbers} |")
    slopes = memory["resident_mb_per_1000"], memory["device_mb_per_1000"]
    rows.append(f"\nSecond half: {slopes[0]:+.1f} MB and {slopes[1]:+.1f} MB for 1000 changes.")
    return "\n".join(rows)


RESULTS = Path(__file__).resolve().parent / "results" / "viewer.json"
_PACKAGES = ("dermis", "wgpu", "rendercanvas", "numpy", "pillow")
_SHARES = {"speed": 0.25, "delay": 0.2, "page": 1.0}  # fractions of the remaining time


def main(
    *,
    head: str = "human",
    adapter: str = "auto",
    size: str | None = None,
    atlas: int | None = None,
    samples: int | None = None,
    frames: int | None = None,
    minutes: float = 10.0,
    changes: int = 1000,
    seconds: float | None = None,
    browser: bool = True,
    output: Path = RESULTS,
) -> int:
    """Measure, print Markdown, and write the raw figures.

    Parameters
    ----------
    head:
        The built-in human, a sample, or a mesh file.
    adapter:
        auto (the best), cpu (software), or part of an adapter's name.
    size:
        Size of the picture, WIDTHxHEIGHT. [default: 640x480 on a software adapter, 1920x1080 on a GPU]
    atlas:
        Side of the atlas [texel]. [default: 512, 2048]
    samples:
        Samples per pixel. [default: 1, 4]
    frames:
        Number of frames of each kind of motion. [default: 16, 300]
    minutes, changes:
        Least duration and number of changes of the memory test; 0 for both skips it.
    seconds:
        Approximate time limit for everything but the memory test [s]. [default: none]
    browser:
        Measure the page too.
    output:
        JSON file with the raw figures.
    """
    check_output(output, (".json",))
    clock = Clock(seconds)
    device = open_device(adapter)
    software = device.adapter.kind == "CPU"
    plan = Plan(
        head,
        device.adapter.name,
        parse_size(size) if size else ((640, 480) if software else (1920, 1080)),
        atlas or (512 if software else 2048),
        samples or (1 if software else 4),
        frames or (16 if software else 300),
    )
    results = Results(_about(device, plan), output, clock)
    del device
    driver = offscreen(plan)
    results.record("speed", partial(speeds, driver, plan))
    results.record("delay", partial(delays, driver, plan))
    if browser:
        results.record("page", partial(page_figures, plan, slider_position(driver, "melanin")))
    del driver
    if minutes or changes:
        watched = _halved(plan) if software else plan  # a thousand changes in ten minutes
        results.record(
            "memory", lambda _: memory_samples(offscreen(watched), watched, minutes, changes).items()
        )
    results.all_figures["peak_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    results.write()
    print_lines(tables(results.all_figures))
    return 1 if results.ended else 0


class Results:
    """Figures measured so far; each is written immediately.

    all_figures : figures of all sections
    ended : sections that ended early; the reason is among their figures
    """

    def __init__(self, all_figures: JsonObject, output: Path, clock: Clock) -> None:
        self.all_figures, self.ended = all_figures, list[str]()
        self._output, self._clock = output, clock

    def record(self, section: str, measured: Callable[[Clock], Iterable[tuple[str, Any]]]) -> None:
        """Record the figures of a section; an error ends it but keeps the earlier figures."""
        figures = self.all_figures[section] = JsonObject()
        self._log(section)
        try:
            for name, figure in measured(self._clock.share(_SHARES.get(section, 1.0))):
                figures[name] = figure
                self._log(f"{section}, {name}")
                self.write()
        except Exception as fault:  # an error of a section does not affect the others
            figures["ended"] = f"{type(fault).__name__}: {fault}"
            self.ended.append(section)
            self._log(f"{section} ended: {figures['ended']}")
            self.write()

    def write(self) -> None:
        """Write all figures."""
        with atomic_file(self._output) as whole:
            whole.write_text(json.dumps(self.all_figures, indent=1) + "\n", encoding="utf-8")

    def _log(self, what: str) -> None:
        print_note(f"{self._clock.elapsed_s:6.1f} s  {what}")


def _halved(plan: Plan) -> Plan:
    width, height = plan.size
    return replace(plan, size=(width // 2, height // 2), atlas=max(64, plan.atlas // 2))


def _about(device: Device, plan: Plan) -> JsonObject:
    """Return the description of adapter and settings."""
    return {
        "adapter": device.adapter.name,
        "kind": device.adapter.kind,
        "python": platform.python_version(),
        "versions": {name: version(name) for name in _PACKAGES},
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "plan": plan.__dict__,
    }


if __name__ == "__main__":
    run_script(main)
