"""How long a measurement may take: a benchmark with little time measures less of everything."""

from __future__ import annotations

import math
import time


class Clock:
    """Time that is left, from now on.

    seconds : in all; None for as long as it takes
    """

    def __init__(self, seconds: float | None = None) -> None:
        self._began = time.perf_counter()
        self._end = self._began + (math.inf if seconds is None else seconds)

    @property
    def gone_s(self) -> float:
        """Since the beginning."""
        return time.perf_counter() - self._began

    @property
    def left_s(self) -> float:
        """Until the end, at least 0."""
        return max(0.0, self._end - time.perf_counter())

    @property
    def over(self) -> bool:
        """Whether nothing is left."""
        return self.left_s <= 0.0

    def share(self, part: float) -> Clock:
        """A part of what is left."""
        return Clock(part * self.left_s)
