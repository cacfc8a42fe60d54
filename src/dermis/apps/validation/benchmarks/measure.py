"""Measurement of one benchmark case: device time by stage, elapsed time, host time and memory."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from itertools import cycle, islice
from pathlib import Path

from dermis.apps.validation.benchmarks.cases import (
    FRAGMENT_TECHNIQUE,
    BenchmarkCase,
    case_scenes,
    case_settings,
)
from dermis.apps.validation.benchmarks.floor import frame_traffic, stage_bytes
from dermis.apps.validation.benchmarks.gpu_gems_3_fragments import FRAGMENT_PASSES
from dermis.frame.renderer import Renderer
from dermis.gpu.command_list import Timing
from dermis.gpu.failures import converted_gpu_failures
from dermis.gpu.memory import allocated_bytes
from dermis.mesh.head import Head
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.techniques import TECHNIQUES


@dataclass(frozen=True)
class FrameCounts:
    """Numbers of frames to draw for the measurements of a case.

    warmup : frames before any measurement, because an idle GPU has a reduced clock rate
    between : frames drawn before each frame whose stages are timed, to keep the clock rate up
    timed : frames whose stages are timed
    sequence : consecutive frames over which the time of a frame is averaged
    """

    warmup: int = 100
    between: int = 5
    timed: int = 9
    sequence: int = 100

    def with_max_duration(self, max_seconds: float, frame_ms: float) -> FrameCounts:
        """Return frame counts reduced so that a case takes at most `max_seconds`, at `frame_ms` per frame."""
        frames = self.warmup + 2 * self.sequence + 2 * self.timed * (1 + self.between)
        fraction = min(1.0, 1e3 * max_seconds / (frame_ms * frames))
        counts = asdict(self).items()
        return FrameCounts(**{name: min(count, max(1, int(fraction * count))) for name, count in counts})


CPU_FRAME_COUNTS = FrameCounts(warmup=0, between=0, timed=3, sequence=3)
_MAX_CASE_S = 30.0  # time limit for the frames of one case


@dataclass(frozen=True)
class BenchmarkRow:
    """Measurements of one benchmark case: medians of times, and memory.

    triangles : number of triangles of the head
    frame_ms : elapsed time per frame in a sequence, with several frames in flight
    gpu_ms : device time of each stage, and of the whole frame as "total"; stages are timed in separate
        passes, so that their sum may exceed the total
    floor_ms : lower bound of each stage's time, derived from its memory traffic, and their sum as "total"
    python_ms : host time to prepare, record and submit a frame while the device is idle
    image_ms : time to transfer the picture of a finished frame to a NumPy array
    memory_mb : memory of textures and buffers [MB]
    """

    case: BenchmarkCase
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
        """Return the ratio of the whole frame's device time to its lower bound."""
        return self.gpu_ms["total"] / self.floor_ms["total"]


def measure_case(
    renderer: Renderer,
    case: BenchmarkCase,
    head: Head,
    folder: Path,
    bytes_per_s: float,
    frame_counts: FrameCounts,
) -> BenchmarkRow:
    """Draw many frames of a case with moving camera and lights, and return the measurements of the case.

    On a slow device, fewer frames are drawn.

    folder : folder in which the file of the diffusion profile is written
    bytes_per_s : memory bandwidth, as measured by `copy_rate` [byte/s]
    frame_counts : numbers of frames to draw

    Raises DermisError if the device cannot draw the frames, for example for lack of memory.
    """
    with (
        converted_gpu_failures(renderer.device),
        TECHNIQUES.temporary_entry(FRAGMENT_TECHNIQUE, FRAGMENT_PASSES),
    ):
        return _measure_case(renderer, case, head, folder, bytes_per_s, frame_counts)


def _measure_case(
    renderer: Renderer,
    case: BenchmarkCase,
    head: Head,
    folder: Path,
    bytes_per_s: float,
    frame_counts: FrameCounts,
) -> BenchmarkRow:
    settings = case_settings(case)
    first, *other_scenes = case_scenes(case, head, folder, max(frame_counts.sequence, frame_counts.timed, 2))
    scenes = cycle([*other_scenes, first])
    renderer.draw(first, settings)
    frame_counts = frame_counts.with_max_duration(_MAX_CASE_S, sequence_ms(renderer, scenes, 1, settings))
    sequence_ms(renderer, scenes, frame_counts.warmup, settings)
    frame_ms = sequence_ms(renderer, scenes, frame_counts.sequence, settings) / frame_counts.sequence
    gpu_ms = stage_ms(renderer, scenes, settings, frame_counts)
    python_ms, image_ms = _host_times_ms(renderer, scenes, settings, frame_counts)
    traffic = frame_traffic(renderer.device, renderer.prepare(first, settings), len(head.mesh.positions))
    return BenchmarkRow(
        case,
        renderer.device.adapter.name,
        len(head.mesh.triangles),
        frame_ms,
        gpu_ms,
        _lower_bound_ms(stage_bytes(traffic), gpu_ms, bytes_per_s),
        python_ms,
        image_ms,
        allocated_bytes() / 1e6,
    )


def sequence_ms(renderer: Renderer, scenes: Iterator[Scene], frame_count: int, settings: Settings) -> float:
    """Draw consecutive frames, and return the total time until the device has finished the last one [ms].

    scenes : scenes that all differ in camera and lights, so no frame can reuse results of another frame
    frame_count : number of frames
    """

    def draw_sequence() -> None:
        for scene in islice(scenes, frame_count):
            renderer.draw(scene, settings, timed=False)
        renderer.device.wait()

    return _elapsed_ms(draw_sequence)


def stage_ms(
    renderer: Renderer, scenes: Iterator[Scene], settings: Settings, frame_counts: FrameCounts
) -> dict[str, float]:
    """Return the median device time of each stage, and of the whole frame as "total" [ms].

    scenes : scenes that all differ, as for `sequence_ms`
    """
    software = renderer.device.adapter.kind == "CPU"
    timings: tuple[Timing, ...] = (True,) if software else (True, "whole")
    times: dict[Timing, list[dict[str, float]]] = {timing: [] for timing in timings}
    for _ in range(frame_counts.timed):
        for timing in timings:
            sequence_ms(renderer, scenes, frame_counts.between, settings)
            times[timing].append(renderer.draw(next(scenes), settings, timed=timing).gpu_ms or {})
    stages = {stage: statistics.median(one[stage] for one in times[True]) for stage in times[True][0]}
    return stages | {"total": statistics.median(one["total"] for one in times[timings[-1]])}


def _host_times_ms(
    renderer: Renderer, scenes: Iterator[Scene], settings: Settings, frame_counts: FrameCounts
) -> tuple[float, float]:
    """Return median host times: to submit a frame, and to transfer its picture to NumPy [ms]."""
    before, after = [], []
    for k in range(max(frame_counts.sequence, frame_counts.timed)):
        renderer.device.wait()
        started, scene = time.perf_counter(), next(scenes)
        rendered = renderer.draw(scene, settings, timed=False)
        before.append(1e3 * (time.perf_counter() - started))
        if k < frame_counts.timed:
            renderer.device.wait()
            after.append(_elapsed_ms(rendered.srgb8))
    return statistics.median(before), statistics.median(after)


def _elapsed_ms(timed_function: Callable[[], object]) -> float:
    started = time.perf_counter()
    timed_function()
    return 1e3 * (time.perf_counter() - started)


def _lower_bound_ms(
    stage_bytes: dict[str, float], gpu_ms: dict[str, float], bytes_per_s: float
) -> dict[str, float]:
    """Return the lower bound of the time of each measured stage, and the sum of the bounds as "total" [ms].

    stage_bytes : memory traffic by stage [byte]
    gpu_ms : measured device time by stage
    bytes_per_s : memory bandwidth, as measured by `copy_rate` [byte/s]
    """
    floor = {stage: 1e3 * stage_bytes[stage] / bytes_per_s for stage in gpu_ms if stage in stage_bytes}
    return floor | {"total": sum(floor.values())}
