"""Median device time of each stage of a warm frame, with shadows drawn again and kept.

python benchmarks/frame.py lee_perry_smith --size 1920x1080 --atlas 2048 --samples 4 --frames 100
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from typing import Annotated, Any

from cyclopts import Parameter, run

import dermis

REPEATS = 9


def measure(renderer: Any, scene: Any, settings: Any, frames: int, keep: bool) -> dict[str, float]:
    """Medians of each stage of warm frames, and the wall clock of a frame in a row of `frames` [ms]."""
    renderer.draw_warm(scene, settings, keep_shadows=keep)
    started = time.perf_counter()
    for _ in range(frames):
        renderer.draw(scene, settings, keep_shadows=keep, timed=False)
    renderer.device.wait()
    frame_ms = 1e3 * (time.perf_counter() - started) / frames
    drawn = [renderer.draw_warm(scene, settings, keep_shadows=keep).gpu_ms or {} for _ in range(REPEATS)]
    times = {stage: statistics.median(one.get(stage, 0.0) for one in drawn) for stage in drawn[0]}
    return times | {"frame": frame_ms}


def table(report: dict[str, Any]) -> str:
    """The report as Markdown."""
    again, kept = report["shadows drawn"], report["shadows kept"]
    rows = [f"| {stage} | {ms:.2f} | {kept.get(stage, 0.0):.2f} |" for stage, ms in again.items()]
    place = f"{report['adapter']}, {report['size']}"
    title = f"{place}, atlas {report['atlas']}, {report['samples']} samples:"
    return "\n".join(
        [title, "", "| stage | shadows drawn [ms] | shadows kept [ms] |", "|---|---|---|", *rows]
    )


def main(
    head: str,
    /,
    *,
    size: str = "1920x1080",
    atlas: int = 2048,
    samples: int = 4,
    frames: int = 100,
    adapter: str = "auto",
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """Render the head `frames` times and print medians as a Markdown table, or as JSON."""
    width, height = (int(side) for side in size.split("x"))
    settings = dermis.Settings(size=(width, height), atlas=atlas, samples=samples)
    renderer = dermis.Renderer(adapter)
    scene = dermis.Scene(dermis.load_head(head))
    report: dict[str, Any] = {"adapter": renderer.device.adapter.name, "size": size}
    report |= {"atlas": atlas, "samples": samples}
    for name, keep in (("shadows drawn", False), ("shadows kept", True)):
        report[name] = measure(renderer, scene, settings, frames, keep)
    sys.stdout.write((json.dumps(report, indent=2) if as_json else table(report)) + "\n")


if __name__ == "__main__":
    run(main)
