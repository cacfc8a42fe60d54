"""Benchmark of all cases of a preset on one adapter."""

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

from dermis.apps.validation.benchmarks.cases import BenchmarkCase
from dermis.apps.validation.benchmarks.floor import copy_rate
from dermis.apps.validation.benchmarks.measure import (
    CPU_FRAME_COUNTS,
    BenchmarkRow,
    FrameCounts,
    measure_case,
)
from dermis.base.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.scene.heads import load_head

_REPORTED_LIBRARIES = ("dermis", "wgpu", "numpy")
ProgressCallback = Callable[[int, int], None]


@dataclass(frozen=True)
class SkippedCase:
    """Case that could not be measured, and the reason."""

    case: BenchmarkCase
    reason: str


@dataclass(frozen=True)
class Benchmark:
    """Measurements of all cases on one machine.

    copy_bytes_s : memory bandwidth of the device, as measured by `copy_rate` [byte/s]
    seconds : duration of the whole benchmark [s]
    rows : measurements of each case
    skipped : cases that could not be measured
    """

    head: str
    adapter: str
    driver: str
    versions: dict[str, str]
    date: str
    copy_bytes_s: float
    seconds: float
    rows: tuple[BenchmarkRow, ...]
    skipped: tuple[SkippedCase, ...] = ()

    @property
    def base_row(self) -> BenchmarkRow | None:
        """Return the measurements of the base case, from which all other cases differ in one parameter.

        Returns None if the base case was skipped.
        """
        return next((row for row in self.rows if not row.case.varies), None)

    def row_with_technique(self, technique: str) -> BenchmarkRow | None:
        """Return the measurements of the case that differs from the base case only in its technique.

        Returns None if this case was skipped.
        """
        rows = (row for row in self.rows if row.case.varies == "technique")
        return next((row for row in rows if row.case.technique == technique), None)

    def relative_time(self, technique: str) -> float | None:
        """Return the device time of the base case with another technique, divided by that of the base case.

        Returns None if one of the two times was not measured.
        """
        other = self.row_with_technique(technique)
        return other.gpu_ms["total"] / self.base_row.gpu_ms["total"] if other and self.base_row else None


def run_benchmark(
    cases: list[BenchmarkCase],
    head: str = "human",
    adapter: str = "auto",
    progress: ProgressCallback | None = None,
    options: Mapping[str, Any] = MappingProxyType({}),
) -> Benchmark:
    """Measure benchmark cases one after another.

    head : name or file of the head
    adapter : graphics device that draws the frames, such as "auto" or "cpu"
    options : options of `load_head`, except the subdivision level
    progress : function called with the number of finished cases and the number of all cases

    Raises DermisError when none of the cases could be measured.
    """
    started = datetime.now(UTC)
    renderer = Renderer(adapter)
    device = renderer.device
    rate = copy_rate(device)
    progress = progress or (lambda done, total: None)
    rows, skipped = _measure_cases(cases, partial(load_head, head, **options), renderer, rate, progress)
    if not rows:
        raise DermisError(skipped[0].reason)
    return Benchmark(
        head,
        device.adapter.name,
        device.adapter.driver,
        {name: version(name) for name in _REPORTED_LIBRARIES} | {"python": platform.python_version()},
        started.isoformat(timespec="seconds"),
        rate,
        (datetime.now(UTC) - started).total_seconds(),
        tuple(rows),
        tuple(skipped),
    )


def _measure_cases(
    cases: list[BenchmarkCase],
    load_case_head: Callable[..., Head],
    renderer: Renderer,
    bytes_per_s: float,
    progress: ProgressCallback,
) -> tuple[list[BenchmarkRow], list[SkippedCase]]:
    """Return the measurements of the cases that could be drawn, and the skipped cases with the reasons.

    load_case_head : function that returns the head for a subdivision level
    bytes_per_s : memory bandwidth, as measured by `copy_rate` [byte/s]
    """
    counts = CPU_FRAME_COUNTS if renderer.device.adapter.kind == "CPU" else FrameCounts()
    subdivided = lru_cache(1)(lambda levels: load_case_head(subdivide=levels))
    rows: list[BenchmarkRow] = []
    skipped: list[SkippedCase] = []
    subdivided(cases[0].subdivide)  # a missing head fails all cases
    with tempfile.TemporaryDirectory() as folder:
        for index, case in enumerate(cases):
            progress(index, len(cases))
            try:
                loaded = subdivided(case.subdivide)
                rows.append(measure_case(renderer, case, loaded, Path(folder), bytes_per_s, counts))
            except DermisError as fault:
                skipped.append(SkippedCase(case, str(fault)))
                renderer.clear_cache()  # frees the resources of the failed case
    return rows, skipped
