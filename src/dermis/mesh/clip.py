"""A motion of a head over time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from dermis.base.quantities import checked_number
from dermis.base.summary import ShortRepr
from dermis.mesh.pose import Pose

_SHOWN = 8  # names in a note
MAX_DURATION_S = 86_400.0
_LATEST_S = 1e9
_SLOWEST, _FASTEST = 0.001, 1000.0
_EARLY = 1e-6  # of a frame: how far a frame that rounding lost may lie before the end


def check_rate(culprit: object, rate: object) -> float:
    """Frames a second; raises DermisError for what are none."""
    return checked_number(culprit, rate, _SLOWEST, _FASTEST, "frames a second")


@dataclass(frozen=True, eq=False, repr=False)
class Clip(ShortRepr):
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
        time_s = checked_number(f"{self.name}: time", seconds, -_LATEST_S, _LATEST_S, "s")
        return self.sample(min(max(time_s, 0.0), self.duration_s))

    def frame_count(self, rate: float) -> int:
        """How many frames it has at a rate [1/s]: frame k is at k / rate, the last not after its end."""
        return math.floor(self.duration_s * check_rate(f"{self.name}: rate", rate) + _EARLY) + 1

    def __post_init__(self) -> None:
        checked_number(
            f"{self.name}: duration",
            self.duration_s,
            0.0,
            MAX_DURATION_S,
            "s: no motion lasts longer than a day",
        )

    @property
    def note(self) -> str:
        """What is left out, in a sentence; empty when all of it is used."""
        if not self.left_out:
            return ""
        names = ", ".join(self.left_out[:_SHOWN])
        more = f" and {len(self.left_out) - _SHOWN} more" if len(self.left_out) > _SHOWN else ""
        return f"{self.name}: the head has no {names}{more}; left out."
