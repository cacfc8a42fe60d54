"""Measure the photons per second of the Monte Carlo simulation for half-spaces, a slab and layered skin.

python benchmarks/monte_carlo.py --photons 1000000 --repeats 5
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from typing import Annotated

from cyclopts import Parameter

from dermis.apps.truths.slab_mc import ScatteringLayer, trace_slab
from dermis.base.command_line import run_script

MEDIA = {
    "half-space, albedo 0.5": [ScatteringLayer(0.5, 0.5)],
    "half-space, albedo 0.9": [ScatteringLayer(0.1, 0.9)],
    "half-space, albedo 0.99": [ScatteringLayer(0.01, 0.99)],
    "half-space, reduced albedo 0.9, g 0.8": [ScatteringLayer(0.1, 4.5, g=0.8)],
    "slab of 2 mean free paths, albedo 0.9": [ScatteringLayer(0.1, 0.9, 2.0)],
    "skin of three layers, red": [
        ScatteringLayer(0.21, 4.8, 0.25),
        ScatteringLayer(0.016, 3.2, 0.2),
        ScatteringLayer(0.0085, 0.45),
    ],
}


def measure(layers: list[ScatteringLayer], photons: int, repeats: int) -> float:
    """Return the median of the photons per second, after compilation."""
    rates = []
    for seed in range(repeats):
        started = time.perf_counter()
        trace_slab(layers, photons, seed)
        rates.append(photons / (time.perf_counter() - started))
    return statistics.median(rates)


def table(report: dict[str, float]) -> str:
    """Return the report as a Markdown table."""
    rows = [f"| {medium} | {rate / 1e6:.2f} |" for medium, rate in report.items()]
    return "\n".join(["| medium | million photons a second |", "|---|---|", *rows])


def main(
    *,
    photons: int = 1_000_000,
    repeats: int = 5,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> None:
    """Trace each medium `repeats` times and print medians as a Markdown table, or as JSON."""
    trace_slab(MEDIA["half-space, albedo 0.5"], 1)
    report = {medium: measure(layers, photons, repeats) for medium, layers in MEDIA.items()}
    sys.stdout.write((json.dumps(report, indent=2) if as_json else table(report)) + "\n")


if __name__ == "__main__":
    run_script(main)
