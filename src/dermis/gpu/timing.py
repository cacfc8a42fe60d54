"""Stage times of a frame: from the device's timestamps, or from the wall clock."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from dermis.gpu.device import Device


class Timestamps:
    """A timestamp at the start of each pass; a pass lasts until the next one begins, so stages add up.

    whole : True takes only the first and the last, as each takes time itself
    """

    def __init__(self, device: Device, *, whole: bool = False) -> None:
        self._device, self._whole = device, whole
        self._queries, self._resolved = device.timestamp_pool()
        self._stages: list[str] = []

    def begin(self, stage: str) -> dict[str, Any] | None:
        """A pass descriptor's `timestamp_writes`; None for no timestamp."""
        full = len(self._stages) >= self._queries.count - 1  # the last one is for the end
        if full or (self._whole and self._stages):
            return None
        return self._mark(stage)

    def _mark(self, stage: str) -> dict[str, Any]:
        self._stages.append(stage)
        return {"query_set": self._queries, "beginning_of_pass_write_index": len(self._stages) - 1}

    def end(self, encoder: Any) -> None:
        """Mark the end of the last pass and resolve the timestamps."""
        if self._stages:
            encoder.begin_compute_pass(label="end", timestamp_writes=self._mark("end")).end()
            encoder.resolve_query_set(self._queries, 0, len(self._stages), self._resolved, 0)

    def stage_ms(self) -> dict[str, float]:
        """Time of each stage, unless only the whole is timed, and "total" [ms]."""
        if not self._stages:
            return {"total": 0.0}
        raw = self._device.handle.queue.read_buffer(self._resolved, 0, 8 * len(self._stages))
        ticks = np.frombuffer(raw, dtype=np.uint64).astype(np.int64)
        ms = 1e-6 * self._device.timestamp_period_ns
        times: dict[str, float] = {}
        for stage, lasted in zip(self._stages, np.diff(ticks), strict=False):
            times[stage] = times.get(stage, 0.0) + float(lasted) * ms
        times = {} if self._whole else times
        times["total"] = float(ticks[-1] - ticks[0]) * ms
        return times


class WallClock:
    """The time from submitting a stage to its end.

    For software adapters: Mesa stamps compute passes before their work is done; waiting costs nothing there.
    """

    def __init__(self) -> None:
        self._times: dict[str, float] = {}

    def measure(self, stage: str, started: float) -> None:
        """Add the time since `started` (time.perf_counter) to the stage."""
        self._times[stage] = self._times.get(stage, 0.0) + 1e3 * (time.perf_counter() - started)

    def stage_ms(self) -> dict[str, float]:
        """Time of each stage, and "total" [ms]."""
        return self._times | {"total": sum(self._times.values())}
