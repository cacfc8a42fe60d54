"""One frame, measured: its stages on the device, its time on the clock, Python's part, and memory."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from dermis.assets.head import Head
from dermis.benchmark.cases import Case
from dermis.benchmark.floor import moved_by, stage_bytes
from dermis.benchmark.scenes import scenes_of, settings_of
from dermis.gpu.memory import held_bytes
from dermis.rendering.renderer import Renderer
from dermis.scene.model import Scene
from dermis.scene.settings import Settings


@dataclass(frozen=True)
class Effort:
    """How often things are done.

    warming : frames before any is measured: a GPU that was idle runs at a fraction of its clock rate
    between : frames between two whose stages are timed, so that it does not cool down
    timed : frames whose stages are timed
    row : frames in a row, for the time of one
    """

    warming: int = 100
    between: int = 5
    timed: int = 9
    row: int = 100


ON_CPU = Effort(warming=0, between=0, timed=3, row=3)


@dataclass(frozen=True)
class Row:
    """What one case took; medians.

    triangles : of the head
    frame_ms : by the clock, of one frame in a row of them with several in flight
    gpu_ms : device time by stage, and "total"
    floor_ms : the stage's bytes at the rate of a copy, and "total"
    python_ms : preparing, recording and submitting a frame, while the device has nothing to do
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
        """Device time over the floor's, of the whole frame."""
        return self.gpu_ms["total"] / self.floor_ms["total"]


def measure(renderer: Renderer, case: Case, head: Head, folder: Path, rate: float, effort: Effort) -> Row:
    """Draw the case again and again, everything anew.

    rate : bytes a second that a copy moves
    """
    settings = settings_of(case)
    scenes = scenes_of(case, head, folder, max(effort.row, effort.timed, 2))
    renderer.draw(scenes[0], settings)
    _row(renderer, [scenes[k % len(scenes)] for k in range(effort.warming)], settings)
    frame_ms = _row(renderer, scenes[: effort.row], settings) / effort.row
    gpu_ms = _stages(renderer, scenes, settings, effort)
    python_ms, image_ms = _around(renderer, scenes[: effort.timed], settings)
    moved = moved_by(renderer.device, renderer.prepare(scenes[0], settings), len(head.mesh.positions))
    return Row(
        case,
        renderer.device.adapter.name,
        len(head.mesh.triangles),
        frame_ms,
        gpu_ms,
        _floor(stage_bytes(moved), gpu_ms, rate),
        python_ms,
        image_ms,
        held_bytes() / 1e6,
    )


def _row(renderer: Renderer, scenes: Sequence[Scene], settings: Settings) -> float:
    """Time of frames that follow each other without a pause [ms]."""

    def draw() -> None:
        for scene in scenes:
            renderer.draw(scene, settings, keep_shadows=False, timed=False)
        renderer.device.wait()

    return _lasted_ms(draw)


def _stages(
    renderer: Renderer, scenes: Sequence[Scene], settings: Settings, effort: Effort
) -> dict[str, float]:
    """Median device time of each stage, and "total" [ms]."""
    drawn = []
    for scene in scenes[: effort.timed]:
        _row(renderer, scenes[: effort.between], settings)
        drawn.append(renderer.draw(scene, settings, keep_shadows=False).gpu_ms or {})
    return {stage: statistics.median(one[stage] for one in drawn) for stage in drawn[0]}


def _around(renderer: Renderer, scenes: Sequence[Scene], settings: Settings) -> tuple[float, float]:
    """What Python takes before a frame, and the image after it [ms]."""
    before, after = [], []
    for scene in scenes:
        renderer.device.wait()
        started = time.perf_counter()
        rendered = renderer.draw(scene, settings, keep_shadows=False, timed=False)
        before.append(1e3 * (time.perf_counter() - started))
        renderer.device.wait()
        after.append(_lasted_ms(rendered.srgb8))
    return statistics.median(before), statistics.median(after)


def _lasted_ms(work: Callable[[], object]) -> float:
    started = time.perf_counter()
    work()
    return 1e3 * (time.perf_counter() - started)


def _floor(moved: dict[str, float], gpu_ms: dict[str, float], rate: float) -> dict[str, float]:
    """Least time of the stages that were drawn, and "total" [ms]."""
    floor = {stage: 1e3 * moved[stage] / rate for stage in gpu_ms if stage in moved}
    return floor | {"total": sum(floor.values())}
