"""Median device time of each stage of a warm frame, with shadows drawn again and kept.

python benchmarks/frame.py lee_perry_smith --size 1920x1080 --atlas 2048 --samples 4 --frames 50
"""

from __future__ import annotations

import json
import statistics
import sys
from typing import Any

from cyclopts import run

import dermis


def median(frames: list[Any]) -> dict[str, float]:
    """Medians over frames of every stage and of the wall clock [ms]."""
    stages = frames[0].gpu_ms or {}
    times = {stage: statistics.median((f.gpu_ms or {}).get(stage, 0.0) for f in frames) for stage in stages}
    return {stage: round(ms, 3) for stage, ms in times.items()} | {
        "frame": round(statistics.median(f.frame_ms for f in frames), 3)
    }


def main(
    head: str,
    /,
    *,
    size: str = "1920x1080",
    atlas: int = 2048,
    samples: int = 4,
    frames: int = 50,
    adapter: str = "auto",
) -> None:
    """Render the head `frames` times and print medians as JSON."""
    width, height = (int(side) for side in size.split("x"))
    settings = dermis.Settings(size=(width, height), atlas=atlas, samples=samples)
    renderer = dermis.Renderer(adapter)
    scene = dermis.Scene(dermis.load_head(head))
    report: dict[str, Any] = {"adapter": renderer.device.adapter.name, "settings": settings.model_dump()}
    for name, keep in (("shadows drawn", False), ("shadows kept", True)):
        for _ in range(max(2, frames // 5)):
            renderer.draw(scene, settings, keep_shadows=keep)
        drawn = [renderer.draw(scene, settings, keep_shadows=keep) for _ in range(frames)]
        report[name] = median(drawn)
    sys.stdout.write(json.dumps(report, indent=2) + "\n")


if __name__ == "__main__":
    run(main)
