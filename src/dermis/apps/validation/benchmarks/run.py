"""A whole benchmark: all cases of a preset on one adapter."""

from __future__ import annotations

import platform
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache, partial
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import Any

from dermis.apps.validation.benchmarks.cases import Case
from dermis.apps.validation.benchmarks.floor import copy_rate
from dermis.apps.validation.benchmarks.measure import CPU_FRAME_COUNTS, FrameCounts, BenchmarkRow, measure_case
from dermis.base.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.scene.heads import load_head

_LIBRARIES = ("dermis", "wgpu", "numpy")
ProgressCallback = Callable[[int, int], None]


@dataclass(frozen=True)
class SkippedCase:
    """A case that could not be measured, and why."""

    case: Case
    reason: str


@dataclass(frozen=True)
class Benchmark:
    """What was measured and where.

    copied : bytes per second that a copy moves
    seconds : duration of the whole run [s]
    left_out : what could not be measured
    """

    head: str
    adapter: str
    driver: str
    versions: dict[str, str]
    date: str
    copied: float
    seconds: float
    rows: tuple[BenchmarkRow, ...]
    left_out: tuple[SkippedCase, ...] = ()

    @property
    def usual(self) -> BenchmarkRow | None:
        """The frame from which all others differ in one thing; None when it could not be measured."""
        return next((row for row in self.rows if not row.case.varies), None)

    def row_of(self, technique: str) -> BenchmarkRow | None:
        """Return the usual frame by another technique; None when it was not measured."""
        found = (row for row in self.rows if row.case.varies == "technique")
        return next((row for row in found if row.case.technique == technique), None)

    def ratio(self, technique: str) -> float | None:
        """Return the device time of another technique over that of our own, in the same frame."""
        other = self.row_of(technique)
        return other.gpu_ms["total"] / self.usual.gpu_ms["total"] if other and self.usual else None


def run_benchmark(
    cases: list[Case],
    head: str = "human",
    adapter: str = "auto",
    progress: ProgressCallback | None = None,
    options: Mapping[str, Any] = MappingProxyType({}),
) -> Benchmark:
    """Measure the cases one after another.

    options : of `load_head`, but for the levels of subdivision
    progress : called with the number of cases done, and of all

    Raises DermisError when none of them could be measured.
    """
    started = datetime.now(UTC)
    renderer = Renderer(adapter)
    device = renderer.device
    rate = copy_rate(device)
    rows, left_out = _measure_cases(
        cases, partial(load_head, head, **options), renderer, rate, progress or (lambda done, of: None)
    )
    if not rows:
        raise DermisError(left_out[0].reason)
    return Benchmark(
        head,
        device.adapter.name,
        device.adapter.driver,
        {name: version(name) for name in _LIBRARIES} | {"python": platform.python_version()},
        started.isoformat(timespec="seconds"),
        rate,
        (datetime.now(UTC) - started).total_seconds(),
        tuple(rows),
        tuple(left_out),
    )


def _measure_cases(
    cases: list[Case], load: Callable[..., Head], renderer: Renderer, rate: float, progress: ProgressCallback
) -> tuple[list[BenchmarkRow], list[SkippedCase]]:
    """Return the cases that could be measured, and the others."""
    effort = CPU_FRAME_COUNTS if renderer.device.adapter.kind == "CPU" else FrameCounts()
    subdivided = lru_cache(1)(lambda levels: load(subdivide=levels))
    rows: list[BenchmarkRow] = []
    left_out: list[SkippedCase] = []
    subdivided(cases[0].subdivide)  # a missing head is an error of all cases
    with tempfile.TemporaryDirectory() as folder:
        for done, case in enumerate(cases):
            progress(done, len(cases))
            try:
                rows.append(measure_case(renderer, case, subdivided(case.subdivide), Path(folder), rate, effort))
            except DermisError as fault:
                left_out.append(SkippedCase(case, str(fault)))
                renderer.clear_cache()  # frees what was made before it failed
    return rows, left_out
