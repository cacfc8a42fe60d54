"""How fast data sets are drawn: python benchmarks/batch.py -o benchmarks/results/scale_NAME.json

On any machine: new people and one person moving, by one worker and by several, and by those of dask. All
numbers of a file are of one run; ratios among them are what to go by on a machine that others use too.
"""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import batch_sections as sections
from batch_sections import Plan
from cyclopts import Parameter, run

from dermis.apps.validation.pages import write_figures
from dermis.base.atomic_write import check_output
from dermis.base.console import note, print_lines
from dermis.base.errors import DermisError
from dermis.cli.options import parse_size

PARTS = ("steps", "new", "moving", "dask", "disk")
_DIGITS = 4


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))],
    adapter: str = "auto",
    size: str = "512x512",
    atlas: int = 1024,
    images: int = 400,
    workers: str = "1,2,4",
    encoders: int | None = None,
    parts: str = ",".join(PARTS),
    disk: Path | None = None,
) -> int:
    """Measure and write the figures.

    Parameters
    ----------
    output:
        JSON to write.
    adapter:
        As of `dermis batch`.
    size:
        Of the images.
    atlas:
        Texels along its side.
    images:
        For each worker of each run; more give steadier numbers.
    workers:
        How many of them, in all, one run after the other.
    encoders:
        Of each worker [by the number of cores].
    parts:
        Of steps, new, moving, dask and disk, with commas.
    disk:
        Folder on the disk that is meant [the system's temporary one].
    """
    try:
        target = check_output(output, (".json",), "Choose such a name")
        plan = Plan(adapter, parse_size(size), atlas, images, encoders, disk)
        counts = [int(one) for one in workers.split(",")]
        told = measure(plan, counts, parts.split(","), lambda told: write_figures(target, told, _DIGITS))
    except DermisError as fault:
        note(f"batch: {fault}")
        return 2
    print_lines(*table(told))
    return 0


def measure(
    plan: Plan, counts: list[int], parts: list[str], keep: Callable[[dict[str, Any]], None]
) -> dict[str, Any]:
    """All figures; `keep` gets those known so far after each part."""
    told: dict[str, Any] = {"machine": sections.machine(plan), **_about()}
    jobs: dict[str, Callable[[], Any]] = {
        "steps": lambda: sections.steps(plan),
        "new": lambda: [sections.workers(plan, count) for count in counts],
        "moving": lambda: [sections.workers(plan, count, moving=True) for count in counts],
        "dask": lambda: sections.dask(plan, counts[-1]),
        "disk": lambda: sections.disk(plan),
    }
    for part in parts:
        if part not in jobs:
            raise DermisError(f"--parts: expected some of {', '.join(PARTS)}, but {part!r} came. Correct it.")
        note(part)
        told[part] = jobs[part]()
        keep(told)
    return told


def table(told: dict[str, Any]) -> list[str]:
    """Lines for people."""
    machine = told["machine"]
    lines = [
        f"{', '.join(machine['adapters'])}, {machine['cores']} cores, "
        f"{machine['size'][0]}x{machine['size'][1]}, atlas {machine['atlas']}, load before {told['load']}"
    ]
    for name in ("new", "moving"):
        runs = told.get(name, [])
        for one in runs:
            ratio = one["images_per_s"] / runs[0]["images_per_s"]
            who = f"{one['workers']:3} workers on {one['adapters']} adapters, {one['encoders']} encoders each"
            rate = f"{one['images_per_s']:9.3g} images/s, {ratio:.2f} x the first"
            lines.append(f"{name:8}{who}{rate}, {one['bytes_per_image'] / 1e3:.0f} kB an image")
    if dask := told.get("dask"):
        lines.append(f"dask    {dask['workers']:3} workers: {dask['dask_over_plain']:.3f} x plain processes")
    if steps := told.get("steps"):
        lines.append("alone   " + ", ".join(f"{name} {ms:.3g} ms" for name, ms in steps.items()))
    if disk := told.get("disk"):
        lines.append(f"disk    {disk['bytes_per_s'] / 1e6:.0f} MB/s")
    return lines


def _about() -> dict[str, Any]:
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    versions = {name: version(name) for name in ("dermis", "wgpu", "numpy")}
    return {
        "versions": versions | {"python": platform.python_version()},
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "load": load,
    }


if __name__ == "__main__":
    sys.exit(run(main))
