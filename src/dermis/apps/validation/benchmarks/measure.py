"""One frame, measured: its stages on the device, its time by the clock, Python's part, and memory."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from itertools import cycle, islice
from pathlib import Path

from dermis.apps.validation.benchmarks.cases import FRAGMENT_TECHNIQUE, Case, case_scenes, case_settings
from dermis.apps.validation.benchmarks.floor import frame_traffic, stage_bytes
from dermis.apps.validation.benchmarks.gpu_gems_3_fragments import FRAGMENT_PASSES as AS_FRAGMENTS
from dermis.frame.renderer import Renderer
from dermis.gpu.command_list import Timing
from dermis.gpu.failures import gpu_failures
from dermis.gpu.memory import allocated_bytes
from dermis.mesh.head import Head
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES


@dataclass(frozen=True)
class FrameCounts:
    """How many frames are drawn.

    warming : before any is measured: a GPU that was idle runs at a fraction of its clock rate
    between : between two whose stages are timed, so that its clock does not fall
    timed : whose stages are timed
    row : in a row, for the mean time of one
    """

    warming: int = 100
    between: int = 5
    timed: int = 9
    row: int = 100

    def within(self, seconds: float, frame_ms: float) -> FrameCounts:
        """Return the same with fewer frames, where these would take longer at `frame_ms` each."""
        frames = self.warming + 2 * self.row + 2 * self.timed * (1 + self.between)
        share = min(1.0, 1e3 * seconds / (frame_ms * frames))
        wanted = asdict(self).items()
        return FrameCounts(**{name: min(count, max(1, int(share * count))) for name, count in wanted})


CPU_FRAME_COUNTS = FrameCounts(warming=0, between=0, timed=3, row=3)
_MAX_CASE_S = 30.0  # for the frames of one case


@dataclass(frozen=True)
class BenchmarkRow:
    """The measurements of one case; medians.

    triangles : of the head
    frame_ms : by the clock, of a frame in a row of them, with several in flight
    gpu_ms : device time by stage, each in a pass of its own, and "total"; on GPUs the total is that of other
        frames, whose stages share one pass as they usually do, and less than the sum
    floor_ms : the stage's bytes at the rate of a copy, and "total"
    python_ms : preparing, recording and submitting a frame while the device is idle
    image_ms : from the end of a frame to its bytes in NumPy
    memory_mb : textures and buffers
    """

    case: Case
    adapter: str
    triangles: int
    frame_ms: float
    gpu_ms: dict[str, float]
    floor_ms: dict[str, float]
    python_ms: float
    image_ms: float
    memory_mb: float

    @property
    def floor_ratio(self) -> float:
        """Device time of the whole frame over its floor."""
        return self.gpu_ms["total"] / self.floor_ms["total"]


def measure_case(renderer: Renderer, case: Case, head: Head, folder: Path, rate: float, effort: FrameCounts) -> BenchmarkRow:
    """Draw the case many times, camera and lights moved each time; fewer times when that would take long.

    rate : bytes per second that a copy moves

    Raises DermisError for frames that the device cannot hold.
    """
    with gpu_failures(renderer.device), TECHNIQUES.including(FRAGMENT_TECHNIQUE, AS_FRAGMENTS):
        return _measure_case(renderer, case, head, folder, rate, effort)


def _measure_case(renderer: Renderer, case: Case, head: Head, folder: Path, rate: float, effort: FrameCounts) -> BenchmarkRow:
    settings = case_settings(case)
    first, *others = case_scenes(case, head, folder, max(effort.row, effort.timed, 2))
    scenes = cycle([*others, first])
    renderer.draw(first, settings)
    effort = effort.within(_MAX_CASE_S, sequence_ms(renderer, scenes, 1, settings))
    sequence_ms(renderer, scenes, effort.warming, settings)
    frame_ms = sequence_ms(renderer, scenes, effort.row, settings) / effort.row
    gpu_ms = stage_ms(renderer, scenes, settings, effort)
    python_ms, image_ms = _host_times_ms(renderer, scenes, settings, effort)
    moved = frame_traffic(renderer.device, renderer.prepare(first, settings), len(head.mesh.positions))
    return BenchmarkRow(
        case,
        renderer.device.adapter.name,
        len(head.mesh.triangles),
        frame_ms,
        gpu_ms,
        _floor_ms(stage_bytes(moved), gpu_ms, rate),
        python_ms,
        image_ms,
        allocated_bytes() / 1e6,
    )


def sequence_ms(renderer: Renderer, scenes: Iterator[Scene], count: int, settings: Settings) -> float:
    """Return the time of frames that follow each other without a pause, until the last one is done [ms].

    scenes : each differs from the one before, so that nothing is kept that camera and lights change
    """

    def draw() -> None:
        for scene in islice(scenes, count):
            renderer.draw(scene, settings, timed=False)
        renderer.device.wait()

    return _elapsed_ms(draw)


def stage_ms(
    renderer: Renderer, scenes: Iterator[Scene], settings: Settings, effort: FrameCounts
) -> dict[str, float]:
    """Median device time of each stage, and of the whole frame as "total" [ms]; scenes as in `row_ms`."""
    software = renderer.device.adapter.kind == "CPU"
    ways: tuple[Timing, ...] = (True,) if software else (True, "whole")
    drawn: dict[Timing, list[dict[str, float]]] = {way: [] for way in ways}
    for _ in range(effort.timed):
        for way in ways:
            sequence_ms(renderer, scenes, effort.between, settings)
            drawn[way].append(renderer.draw(next(scenes), settings, timed=way).gpu_ms or {})
    found = {stage: statistics.median(one[stage] for one in drawn[True]) for stage in drawn[True][0]}
    return found | {"total": statistics.median(one["total"] for one in drawn[ways[-1]])}


def _host_times_ms(
    renderer: Renderer, scenes: Iterator[Scene], settings: Settings, effort: FrameCounts
) -> tuple[float, float]:
    """Return medians of Python's time before a frame, and of fetching its image [ms]."""
    before, after = [], []
    for k in range(max(effort.row, effort.timed)):
        renderer.device.wait()
        started, scene = time.perf_counter(), next(scenes)
        rendered = renderer.draw(scene, settings, timed=False)
        before.append(1e3 * (time.perf_counter() - started))
        if k < effort.timed:
            renderer.device.wait()
            after.append(_elapsed_ms(rendered.srgb8))
    return statistics.median(before), statistics.median(after)


def _elapsed_ms(work: Callable[[], object]) -> float:
    started = time.perf_counter()
    work()
    return 1e3 * (time.perf_counter() - started)


def _floor_ms(moved: dict[str, float], gpu_ms: dict[str, float], rate: float) -> dict[str, float]:
    """Return floor of each stage that was drawn, and "total" [ms]."""
    floor = {stage: 1e3 * moved[stage] / rate for stage in gpu_ms if stage in moved}
    return floor | {"total": sum(floor.values())}
