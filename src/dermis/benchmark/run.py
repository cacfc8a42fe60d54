"""A whole benchmark: all cases of a preset on one adapter, in one run."""

from __future__ import annotations

import platform
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

from dermis.assets.head import load_head
from dermis.benchmark.cases import Case
from dermis.benchmark.copy_rate import copy_rate
from dermis.benchmark.measure import ON_CPU, Effort, Row, measure
from dermis.rendering.renderer import Renderer

_LIBRARIES = ("dermis", "wgpu", "numpy")
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Benchmark:
    """What was measured and where.

    copied : bytes a second that a copy moves
    seconds : the whole run took [s]
    """

    head: str
    adapter: str
    driver: str
    versions: dict[str, str]
    date: str
    copied: float
    seconds: float
    rows: tuple[Row, ...]

    @property
    def usual(self) -> Row:
        """The frame that all others differ from in one thing."""
        return self.rows[0]

    @property
    def published_ratio(self) -> float | None:
        """Device time of the published passes of 2007 over that of our own, in the same frame."""
        found = [row for row in self.rows if row.case.technique == "published"]
        return found[0].gpu_ms["total"] / self.usual.gpu_ms["total"] if found else None


def run(
    cases: list[Case], head: str = "bust", adapter: str = "auto", progress: Progress | None = None
) -> Benchmark:
    """Measure the cases one after another.

    progress : told how many of how many are done
    """
    started = datetime.now(UTC)
    renderer = Renderer(adapter)
    device = renderer.device
    effort = ON_CPU if device.adapter.kind == "CPU" else Effort()
    subdivided = lru_cache(1)(lambda levels: load_head(head, subdivide=levels))
    rows, rate = [], copy_rate(device)
    with tempfile.TemporaryDirectory() as folder:
        for done, case in enumerate(cases):
            if progress:
                progress(done, len(cases))
            rows.append(measure(renderer, case, subdivided(case.subdivide), Path(folder), rate, effort))
    return Benchmark(
        head,
        device.adapter.name,
        device.adapter.driver,
        {name: version(name) for name in _LIBRARIES} | {"python": platform.python_version()},
        started.isoformat(timespec="seconds"),
        rate,
        (datetime.now(UTC) - started).total_seconds(),
        tuple(rows),
    )
