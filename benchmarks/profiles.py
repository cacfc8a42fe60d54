"""Measure the median time from tissue to six shared Gaussians, on one core."""

from __future__ import annotations

import os

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")

import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import dermis
from dermis.base.command_line import run_script
from dermis.optics.fits.gaussian import fit_gaussians

REPEATS = 15


def median_ms(work: Callable[[], object]) -> float:
    """Return the median time of repeated runs, after a warm-up run [ms]."""
    work()
    times = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        work()
        times.append(1e3 * (time.perf_counter() - started))
    return statistics.median(times)


def neighbour(tissue: dermis.Tissue) -> dermis.Tissue:
    """Return the tissue with 10 % more absorption, as after the move of a slider."""
    layers = tuple(replace(layer, sigma_a=1.1 * layer.sigma_a) for layer in tissue.medium.layers)
    return replace(tissue, medium=replace(tissue.medium, layers=layers))


def main() -> None:
    """Print a Markdown table."""
    columns = ("layers -> profile [ms]", "profile -> six Gaussians [ms]", "warm start [ms]")
    rows = [f"| tissue | {' | '.join(columns)} |", "|---|---|---|---|"]
    for name in ("dj3", "skin1", "light", "dark"):
        tissue = dermis.load_tissue(name)
        rings = tissue.profile().ring_target()
        near = fit_gaussians(rings, 6).profile
        moved = neighbour(tissue).profile().ring_target()
        cells = (
            median_ms(tissue.profile),
            median_ms(partial(fit_gaussians, rings, 6)),
            median_ms(partial(fit_gaussians, moved, 6, similar_fit=near)),
        )
        rows.append(f"| {name} | {' | '.join(f'{ms:.1f}' for ms in cells)} |")
    sys.stdout.write("\n".join(rows) + "\n")


if __name__ == "__main__":
    run_script(main)
