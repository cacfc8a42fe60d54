"""Writes docs/scale.md from what `batch.py` has measured: python benchmarks/batch_page.py

Each results/batch_*.json is a machine.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "scale.md"
RESULTS = ROOT / "benchmarks" / "results"
IMAGES = 10_000_000
_SHARD = 1000  # images

Told = dict[str, Any]


def main() -> int:
    """Write the page."""
    PAGE.write_text(page([json.loads(path.read_text("utf-8")) for path in sorted(RESULTS.glob("batch_*.json"))]))
    return 0


def page(machines: Sequence[Told]) -> str:
    """The page's text."""
    return "\n".join([_HEAD, *(f"{_machine(told)}\n" for told in machines)])


def _machine(told: Told) -> str:
    machine = told["machine"]
    width, height = machine["size"]
    parts = [
        f"## {', '.join(machine['adapters'])}, {machine['cores']} cores\n",
        f"{width} x {height}, atlas {machine['atlas']}; written with each picture: {', '.join(machine['outputs'])} "
        f"and landmarks. {told['date'][:10]}, dermis {told['versions']['dermis']}, "
        f"wgpu {told['versions']['wgpu']}; load of the machine before: {told['load']}.\n",
        "### Measured\n",
        _rates(told),
        "### An image by itself\n",
        _table(("step", "ms"), [(name.replace("_", " "), f"{ms:.3g}") for name, ms in told["steps"].items()]),
        f"### On paper: {IMAGES:,} images of new people\n",
        _table(("", ""), paper(told)),
    ]
    return "\n".join(parts)


def _rates(told: Told) -> str:
    rows = []
    for name, words in (("new", "new people"), ("moving", "one person, moving")):
        runs = told.get(name, [])
        for one in runs:
            memory = " to ".join(f"{size / 1e6:.0f}" for size in one["worker_bytes"]) or "unknown"
            ratio = one["images_per_s"] / runs[0]["images_per_s"]
            who = one["workers"], one["adapters"], one["encoders"]
            rows.append((words, *who, f"{one['images_per_s']:.3g}", f"{ratio:.2f}", memory))
    heads = "what", "workers", "adapters", "encoders of each", "images/s", "over the first", "memory of one [MB]"
    text = _table(heads, rows)
    if dask := told.get("dask"):
        share = 1 - dask["dask_over_plain"]
        text += f"\nWorkers of dask draw {share:.1%} less than as many plain processes ({dask['workers']}).\n"
    return text


def paper(told: Told) -> list[tuple[str, str]]:
    """What so many images take where the fastest measured run goes on like that."""
    best = max(told["new"], key=lambda one: float(one["images_per_s"]))
    rate, size = best["images_per_s"], best["bytes_per_image"]
    hours = IMAGES / rate / 3600
    limits = ceilings(told, best)
    first = min(limits, key=lambda name: limits[name])
    return [
        ("images/s", f"{rate:.3g}"),
        ("hours of this machine", f"{hours:,.0f}"),
        ("hours of an adapter", f"{hours * best['adapters']:,.0f}"),
        ("hours of a core, encoding", f"{IMAGES * told['steps']['encode'] / 3.6e6:,.0f}"),
        ("bytes", f"{IMAGES * size / 1e12:.3g} TB"),
        ("files", f"{IMAGES // _SHARD:,} shards of {_SHARD * size / 1e6:,.0f} MB"),
        *((f"at most, by {name}", f"{limit:,.3g} images/s") for name, limit in limits.items()),
        ("what is reached first", first),
    ]


def ceilings(told: Told, run: Told) -> dict[str, float]:
    """Images/s that each part could do if the others took no time."""
    steps, encoders = told["steps"], run["workers"] * run["encoders"]
    drawing = steps["parameters"] + steps["scene"] + steps["draw_and_read"]
    if not encoders:
        drawing += steps["encode"]
    found = {"the workers' own time": 1e3 * run["workers"] / drawing}
    if encoders:
        found["encoding"] = 1e3 * encoders / steps["encode"]
    if "disk" in told:
        found["the disk"] = told["disk"]["bytes_per_s"] / run["bytes_per_image"]
    return found


def _table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(map(str, line))} |\n" for line in lines)


_HEAD = f"""\
# Data sets at scale

What {IMAGES:,} images take, extrapolated from what `python benchmarks/batch.py` measures in one run on a machine.
Written by `python benchmarks/batch_page.py`. Rates are those between a quarter and nine tenths of a run, when all
processes are at work. Steps are timed one after the other in one process, so that the device waits for Python and
Python for the device; in a run they overlap, and "at most, by the workers' own time" is what they would do without that overlap.
"""

if __name__ == "__main__":
    sys.exit(main())
