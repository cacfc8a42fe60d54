"""Median device time of each stage of a warm frame, with shadows drawn again and kept.

python benchmarks/frame.py lee_perry_smith --size 1920x1080 --atlas 2048 --samples 4 --frames 100
"""

from __future__ import annotations

import json
import statistics
import sys
from typing import Annotated, Any

from cyclopts import Parameter, run

import dermis

IN_FLIGHT = 4


def median(frames: list[Any]) -> dict[str, float]:
    """Medians over frames of every stage and of the wall clock [ms]."""
    stages = frames[0].gpu_ms or {}
    times = {stage: statistics.median((f.gpu_ms or {}).get(stage, 0.0) for f in frames) for stage in stages}
    return times | {"frame": statistics.median(f.frame_ms for f in frames)}


def measure(renderer: Any, scene: Any, settings: Any, frames: int, keep: bool) -> dict[str, float]:
    """Medians over `frames` warm frames.

    A GPU gets untimed frames in between: it never waits for Python, so that its clocks stay up.
    """
    between = 1 if renderer.device.adapter.kind == "CPU" else IN_FLIGHT
    renderer.draw(scene, settings)
    drawn = []
    for number in range(frames):
        timed = number % between == between - 1
        one = renderer.draw(scene, settings, keep_shadows=keep, timed=timed)
        drawn += [one] if timed else []
    return median(drawn)


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
