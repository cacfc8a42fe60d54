"""Clips: poses of a head as a function of time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from dermis.base.quantities import checked_number
from dermis.base.summary import ShortRepr
from dermis.mesh.pose import Pose

_MAX_LISTED_NAMES = 8  # largest number of names in a note
MAX_DURATION_S = 86_400.0
_MAX_TIME_S = 1e9
_MIN_FRAME_RATE, _MAX_FRAME_RATE = 0.001, 1000.0
_END_TOLERANCE_FRAMES = 1e-6  # fraction of a frame by which rounding may put the last frame behind the end


def check_frame_rate(setting_name: object, frame_rate: object) -> float:
    """Return a frame rate [1/s] unchanged if it is within the allowed range; raise DermisError otherwise.

    setting_name : name of the option or file in the error message
    """
    return checked_number(setting_name, frame_rate, _MIN_FRAME_RATE, _MAX_FRAME_RATE, "frames a second")


@dataclass(frozen=True, eq=False, repr=False)
class Clip(ShortRepr):
    """Motion of a head over time, as read from a file by `load_motion`.

    Parameters
    ----------
    name : str
        Name of the clip, or of its file.
    duration_s : float
        Time of the last frame [s].
    rate : float or None
        Frame rate that the file states [1/s]; None if the file states no rate.
    targets, bones : tuple of str
        Names of the morph targets and bones that the clip moves.
    left_out : tuple of str
        Names of targets and bones in the file that the head does not have.
    sample : callable
        Function that returns the pose at a time from 0 to the duration [s].

    Raises
    ------
    DermisError
        For a duration of more than a day.

    Examples
    --------
    >>> from dermis import Clip, Pose
    >>> clip = Clip("nod", 2.0, None, ("jawOpen",), (), (), lambda t: Pose({"jawOpen": t / 2}))
    >>> clip.pose_at(1.0).weights["jawOpen"], clip.frame_count(30.0)
    (0.5, 61)
    """

    name: str
    duration_s: float
    rate: float | None
    targets: tuple[str, ...]
    bones: tuple[str, ...]
    left_out: tuple[str, ...]
    sample: Callable[[float], Pose]

    def pose_at(self, seconds: float) -> Pose:
        """Return the pose at a time.

        Parameters
        ----------
        seconds : float
            Time [s]. A time before the start gives the first pose, a time after the end gives the last pose.

        Returns
        -------
        Pose
            Pose of the head.

        Raises
        ------
        DermisError
            For an invalid time, and for a frame that cannot be read.
        """
        time_s = checked_number(f"{self.name}: time", seconds, -_MAX_TIME_S, _MAX_TIME_S, "s")
        return self.sample(min(max(time_s, 0.0), self.duration_s))

    def frame_count(self, rate: float) -> int:
        """Return the number of frames at a frame rate.

        Parameters
        ----------
        rate : float
            Frame rate [1/s]. Frame k shows the time k / rate; frames after the end of the clip do not count.

        Returns
        -------
        int
            Number of frames.

        Raises
        ------
        DermisError
            For an invalid rate.
        """
        return (
            math.floor(self.duration_s * check_frame_rate(f"{self.name}: rate", rate) + _END_TOLERANCE_FRAMES)
            + 1
        )

    def __post_init__(self) -> None:
        """Refuse an invalid duration."""
        unit = "s: no motion is longer than a day"
        checked_number(f"{self.name}: duration", self.duration_s, 0.0, MAX_DURATION_S, unit)

    @property
    def note(self) -> str:
        """Return a sentence that names the targets and bones in `left_out`; empty if there are none.

        The motion file moves them, but the head does not have them.
        """
        if not self.left_out:
            return ""
        names = ", ".join(self.left_out[:_MAX_LISTED_NAMES])
        more = (
            f" and {len(self.left_out) - _MAX_LISTED_NAMES} more"
            if len(self.left_out) > _MAX_LISTED_NAMES
            else ""
        )
        return f"{self.name}: the head has no {names}{more}; left out."
