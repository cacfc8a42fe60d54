"""The viewer's speed, delay and memory: python benchmarks/viewer.py

No screen is needed: an offscreen canvas takes the place of the window, and a client that speaks as the page
does that of the browser. About a quarter of an hour, most of it for memory; --minutes 0.5 --changes 50 is a
quick look.
"""

from __future__ import annotations

import json
import platform
import resource
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from cyclopts import run
from viewer_hands import Plan, delays, offscreen, speeds
from viewer_memory import endured
from viewer_page import through_the_page
from viewer_tables import tables

from dermis.cli.console import note, print_lines
from dermis.cli.options import parse_size
from dermis.gpu import Device, open_device
from dermis.outputs import check_output, replacing

RESULTS = Path(__file__).resolve().parent / "results" / "viewer.json"
_PACKAGES = ("dermis", "wgpu", "rendercanvas", "numpy")


def main(
    *,
    head: str = "bust",
    adapter: str = "auto",
    size: str | None = None,
    atlas: int | None = None,
    samples: int | None = None,
    frames: int | None = None,
    minutes: float = 10.0,
    changes: int = 1000,
    browser: bool = True,
    output: Path = RESULTS,
) -> int:
    """Measure, print Markdown, and write the raw figures.

    Parameters
    ----------
    head:
        The built-in bust, a sample, or a mesh file.
    adapter:
        auto (the best), cpu (software), or a part of an adapter's name.
    size:
        WIDTHxHEIGHT of the picture [640x480 on a software adapter, 1920x1080 on a GPU].
    atlas:
        Side of the irradiance map [512, 2048].
    samples:
        Samples of a pixel [1, 4].
    frames:
        Of each kind of motion [16, 300].
    minutes, changes:
        What the memory is watched over, at least, on software adapters with half the sides; 0 for both
        leaves it out.
    browser:
        Whether the page is measured too.
    output:
        Where the figures go.
    """
    check_output(output, (".json",))
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
    found = _about(device, plan)
    del device
    hands = offscreen(plan)
    note("motion")
    found["speed"] = speeds(hands, plan)
    note("delay")
    found["delay"] = delays(hands, plan)
    if browser:
        note("page")
        found["page"] = through_the_page(plan)
    if minutes or changes:
        note("memory")
        del hands
        watched = _halved(plan) if software else plan  # a thousand changes in ten minutes
        found["memory"] = endured(offscreen(watched), watched, minutes, changes)
    found["peak_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    with replacing(output) as whole:
        whole.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print_lines(tables(found))
    return 0


def _halved(plan: Plan) -> Plan:
    width, height = plan.size
    return replace(plan, size=(width // 2, height // 2), atlas=max(64, plan.atlas // 2))


def _about(device: Device, plan: Plan) -> dict[str, Any]:
    """What was measured on what."""
    return {
        "adapter": device.adapter.name,
        "kind": device.adapter.kind,
        "python": platform.python_version(),
        "versions": {name: version(name) for name in _PACKAGES},
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "plan": plan.__dict__,
    }


if __name__ == "__main__":
    run(main)
