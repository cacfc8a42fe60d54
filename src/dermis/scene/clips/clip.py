"""A motion of a head over time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from dermis.errors import refuse
from dermis.scene.pose import Pose
from dermis.summary import Summarised

_SHOWN = 8  # names in a note
_EARLY = 1e-6  # of a frame: how far a frame that rounding lost may lie before the end


@dataclass(frozen=True, eq=False, repr=False)
class Clip(Summarised):
    """A motion that a file holds, for one head: `pose_at` gives its pose at any time.

    name : of the clip, else of its file
    duration_s : the time of its last frame [s]
    rate : its own frames a second; None where it has none
    targets, bones : names of the head's that it moves
    left_out : names in the file that the head lacks
    sample : the pose at a time from 0 to its duration [s]
    """

    name: str
    duration_s: float
    rate: float | None
    targets: tuple[str, ...]
    bones: tuple[str, ...]
    left_out: tuple[str, ...]
    sample: Callable[[float], Pose]

    def pose_at(self, seconds: float) -> Pose:
        """The pose at a time [s]; before its beginning and after its end the first and the last.

        Raises DermisError for a time that is none, and for a frame that cannot be read.
        """
        if not math.isfinite(seconds):
            refuse(self.name, "a finite time", f"{seconds} came", "Correct it")
        return self.sample(min(max(float(seconds), 0.0), self.duration_s))

    def frame_count(self, rate: float) -> int:
        """How many frames it has at a rate [1/s]: frame k is at k / rate, the last not after its end."""
        if not (math.isfinite(rate) and rate > 0):
            refuse(self.name, "a rate above 0", f"{rate} came", "Give the frames a second")
        return math.floor(self.duration_s * rate + _EARLY) + 1

    @property
    def note(self) -> str:
        """What is left out, in a sentence; empty when all of it is used."""
        if not self.left_out:
            return ""
        names = ", ".join(self.left_out[:_SHOWN])
        more = f" and {len(self.left_out) - _SHOWN} more" if len(self.left_out) > _SHOWN else ""
        return f"{self.name}: the head has no {names}{more}; left out."
