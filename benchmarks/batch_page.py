"""Write docs/scale.md from the results of `batch.py`.

Each file results/scale_*.json describes one machine.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from dermis.apps.validation.pages import JsonObject
from dermis.base.atomic_write import atomic_file
from dermis.base.command_line import run_script

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "scale.md"
RESULTS = ROOT / "benchmarks" / "results"
IMAGES = 10_000_000
_SHARD_IMAGES = 1000
_KINDS = {"new": "new people", "moving": "one person, moving"}
_COLUMNS = (
    "task",
    "workers",
    "adapters",
    "encoders per worker",
    "images/s",
    "relative to the first",
    "memory per worker [MB]",
)


def main() -> None:
    """Write the page."""
    measured = [json.loads(path.read_text("utf-8")) for path in sorted(RESULTS.glob("scale_*.json"))]
    with atomic_file(PAGE) as trial:
        trial.write_text(page(measured), encoding="utf-8")


def page(machines: Sequence[JsonObject]) -> str:
    """Return the text of the page."""
    return "\n".join([_INTRODUCTION, *map(_machine, machines)])


def _machine(figures: JsonObject) -> str:
    machine, versions = figures["machine"], figures["versions"]
    width, height = machine["size"]
    parts = [
        f"## {', '.join(machine['adapters'])}, {machine['cores']} cores\n",
        f"{width} x {height}, atlas {machine['atlas']}; outputs of each picture: "
        f"{', '.join(machine['outputs'])}, landmarks and parameters.\n"
        f"{figures['date'][:10]}, dermis {versions['dermis']}, wgpu {versions['wgpu']}; "
        f"load average before the run: {figures['load']}.{_remarks(figures)}\n",
        "### Measured\n",
        _rates(figures),
    ]
    if steps := figures.get("steps"):
        rows = [(name.replace("_", " "), f"{ms:.3g}") for name, ms in steps.items()]
        parts += ["### Steps of a single image\n", _table(("step", "ms"), rows)]
    parts += [
        f"### Extrapolation: {IMAGES:,} images of new people\n",
        _table(("", ""), extrapolation(figures)),
    ]
    return "\n".join(parts)


def _remarks(figures: JsonObject) -> str:
    """Return the remarks on the measurements of a machine, to follow another sentence."""
    return f" {figures['note']}" if "note" in figures else ""


def _memory(figures: JsonObject) -> str:
    """Return a text on the memory of a worker by number of images, if it was measured."""
    rows = [
        (_KINDS[name], one["workers"], mark, f"{size / 1e6:.0f}")
        for name in _KINDS
        for one in figures.get(name, [])
        for mark, size in one.get("resident_bytes", {}).items()
    ]
    heads = "task", "workers", "images per worker, about", "memory of the largest [MB]"
    return f"\n{_table(heads, rows)}" if rows else ""


def _rates(figures: JsonObject) -> str:
    rows = []
    for name, words in _KINDS.items():
        runs = figures.get(name, [])
        for one in runs:
            memory = " to ".join(f"{size / 1e6:.0f}" for size in one["worker_bytes"]) or "unknown"
            ratio = one["images_per_s"] / runs[0]["images_per_s"]
            who = one["workers"], one["adapters"], one["encoders"]
            rows.append((words, *who, f"{one['images_per_s']:.3g}", f"{ratio:.2f}", memory))
    text = _table(_COLUMNS, rows) + _memory(figures)
    if dask := figures.get("dask"):
        ratio = dask["dask_over_plain"]
        text += (
            f"\n{dask['workers']} workers of dask render {ratio:.3f} times as many images per second as the "
            "same number of plain processes.\n"
        )
    return text


def extrapolation(figures: JsonObject) -> list[tuple[str, str]]:
    """Return table rows with time and space for `IMAGES` images, at the rate of the fastest run."""
    best = max(figures["new"], key=lambda one: float(one["images_per_s"]))
    rate, size = best["images_per_s"], best["bytes_per_image"]
    hours, limits = IMAGES / rate / 3600, ceilings(figures, best)
    rows = [
        ("images/s", f"{rate:.3g}"),
        ("hours on this machine", f"{hours:,.0f}"),
        ("adapter hours", f"{hours * best['adapters']:,.0f}"),
        ("bytes", f"{IMAGES * size / 1e12:.3g} TB"),
        ("files", f"{IMAGES // _SHARD_IMAGES:,} shards of {_SHARD_IMAGES * size / 1e6:,.0f} MB"),
        *((f"limit by {name}", f"{limit:,.3g} images/s") for name, limit in limits.items()),
    ]
    if "steps" in figures and "disk" in figures:
        rows.append(("lowest limit", min(limits, key=lambda name: limits[name])))
    return rows


def ceilings(figures: JsonObject, run: JsonObject) -> dict[str, float]:
    """Return the images/s that each measured step would permit if it were the only limit."""
    found, encoders = {}, run["workers"] * run["encoders"]
    if steps := figures.get("steps"):
        drawing = steps["parameters"] + steps["scene"] + steps["draw_and_read"]
        drawing += 0.0 if encoders else steps["encode"]
        found["the workers' own time"] = 1e3 * run["workers"] / drawing
        if encoders:
            found["encoding"] = 1e3 * encoders / steps["encode"]
    if disk := figures.get("disk"):
        found["the disk"] = disk["bytes_per_s"] / run["bytes_per_image"]
    return found


def _table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(map(str, line))} |\n" for line in lines)


_INTRODUCTION = f"""\
# Data sets at scale

This page lists measured rates of `dermis batch`, and the time and space that {IMAGES:,} images need at these
rates. `python benchmarks/batch.py` measures them in one run per machine, and
`python benchmarks/batch_page.py` writes this page.

Rates are measured between a quarter and nine tenths of a run, when all processes are busy. Steps are timed
one after the other in one process, in which the device and Python wait for each other. In a run they
overlap, so the rate can exceed the limit "by the workers' own time". On a machine with other load,
only ratios are meaningful.

The unit of work is a part of 16 to 32 images, so all workers are busy until fewer parts are left than
workers, and 500 images keep 16 workers busy. Workers verify existing shards after they have rendered the
missing images.
"""

if __name__ == "__main__":
    run_script(main)
