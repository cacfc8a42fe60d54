"""Measures all that docs/performance.md says of a GPU: python benchmarks/gpu_server.py -o result.json

For a server without a screen; it ends within --minutes. Each part is written as soon as it is measured, so
a run that is cut short loses little. --quick tries all parts at tiny sizes, on any adapter.
"""

from __future__ import annotations

import platform
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import gpu_sections
from cyclopts import Parameter, run
from gpu_sections import Plan, plan_of, quick_plan

import dermis
from dermis.apps.validation.pages import write_figures
from dermis.base.atomic_write import check_output
from dermis.base.console import note
from dermis.base.errors import DermisError
from dermis.formats.samples import cached

PARTS = ("bench", "lobes", "sequences", "lights", "options", "start", "viewer", "film")
"""What matters most first; lobes while the device is at work, for an idle one is three times as slow."""
_NEEDED_S = {"bench": 0, "film": 120, "viewer": 120}  # that a part may take on a slow server
_DIGITS = 5


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    head: str = "auto",
    adapter: str = "auto",
    parts: str = ",".join(PARTS),
    minutes: float = 8.0,
    quick: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Measure and write the figures.

    Parameters
    ----------
    output:
        JSON to write.
    head:
        auto (the scan lee_perry_smith when it is here, else human), a sample or a file.
    adapter:
        auto (the best), cpu (software), or a part of an adapter's name.
    parts:
        Of bench, lobes, sequences, lights, options, start, viewer and film, with commas.
    minutes:
        No part is begun that would not end within them.
    quick:
        Tiny sizes.
    """
    try:
        target = check_output(output, (".json",), "Choose such a name")
        name = ("lee_perry_smith" if cached("lee_perry_smith") else "human") if head == "auto" else head
        plan = (quick_plan if quick else plan_of)(adapter, name)
        measure(plan, _chosen(parts), minutes, lambda told: write_figures(target, told, _DIGITS))
    except DermisError as fault:
        note(f"gpu_server: {fault}")
        return 2
    return 0


def measure(
    plan: Plan, parts: list[str], minutes: float, keep: Callable[[dict[str, Any]], None]
) -> dict[str, Any]:
    """All figures; `keep` gets those known so far after each part."""
    began = time.perf_counter()
    head, renderer = dermis.load_head(plan.head, subdivide=0), dermis.Renderer(plan.adapter)
    told = _about(plan, renderer)
    for part in parts:
        note(part)
        started = time.perf_counter()
        left = 60.0 * minutes - (started - began)
        told[part] = _measured(part, plan, head, renderer, left)
        told["seconds"][part] = time.perf_counter() - started
        keep(told)
    return told


def _measured(part: str, plan: Plan, head: Any, renderer: Any, left: float) -> Any:
    """A part's figures, or why there are none."""
    if left < _NEEDED_S.get(part, 20):
        return {"left_out": f"{left:.0f} s were left"}
    try:
        return getattr(gpu_sections, part)(plan, head, renderer)
    except DermisError as fault:
        note(f"left out: {fault}")
        return {"left_out": str(fault)}
    finally:
        renderer.forget()  # the next part may need all of the memory


def _about(plan: Plan, renderer: Any) -> dict[str, Any]:
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


def _chosen(parts: str) -> list[str]:
    names = parts.split(",")
    for name in names:
        if name not in PARTS:
            raise DermisError(
                f"--parts: expected names of {', '.join(PARTS)}, but {name!r} came. Correct it."
            )
    return names


if __name__ == "__main__":
    sys.exit(run(main))
