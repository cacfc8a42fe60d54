"""Plays a motion: the pose of each moment while it runs, a step of the undo history where it stops."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from dermis.apps.viewer.state import History, ViewerState
from dermis.base.errors import DermisError
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head
from dermis.scene.motion import load_motion


class MotionFile:
    """The file of a motion, and the clip that it is for a head.

    path : of anything that `load_motion` takes
    fps : frames a second where the file does not tell
    """

    def __init__(self, path: str | Path, fps: float | None = None) -> None:
        self.path, self._fps = str(path), fps
        self._last: tuple[Head, Clip] | None = None

    def clip(self, head: Head) -> Clip:
        """The clip for a head; that of the last head is kept.

        Raises DermisError for a file that cannot be read and for a head without its names.
        """
        if self._last is None or self._last[0] is not head:
            self._last = head, load_motion(self.path, head, fps=self._fps)
        return self._last[1]


class Player:
    """Where a motion is, and what it shows.

    While it plays, the history stays as it is: what else is changed meanwhile is a step as ever, and the
    pose of the moment is laid over it. Where it stops, its pose becomes a step.

    motion : None for none
    clock : time [s]

    is_playing : whether the motion runs
    loops : whether the motion begins again at its end
    note : what of it the head lacks, or why it cannot be played
    """

    def __init__(
        self,
        history: History,
        motion: MotionFile | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._history, self._clock = history, clock
        self.loops, self.note = True, ""
        self._motion = motion
        self._clip: Clip | None = None
        self._head: Head | None = None
        self._seconds = 0.0
        self.is_playing = False
        self._starting = False  # whether no picture of it has been drawn yet
        self._began: float | None = None  # by the clock, where the motion's beginning would lie
        self._shown: tuple[ViewerState, float, ViewerState] | None = None

    @property
    def has_motion(self) -> bool:
        """Whether there is a motion, for this head or another."""
        return self._motion is not None

    @property
    def clip(self) -> Clip | None:
        """The motion for the head of now; None without one and where the head cannot take it."""
        head = self._history.state.scene.head
        if self._motion is not None and self._head is not head:
            self._head, self._clip = head, None
            try:
                self._clip = self._motion.clip(head)
                self.note = self._clip.note
            except DermisError as error:
                self.note = str(error)
        return self._clip

    @property
    def seconds(self) -> float:
        """Where in the motion it is [s]."""
        return self._seconds if self.is_playing else self._history.state.seconds

    @property
    def shown(self) -> ViewerState:
        """The state of now, moved while the motion plays."""
        state = self._history.state
        clip = self.clip if self.is_playing else None
        if clip is None:
            return state
        if self._shown is None or self._shown[0] is not state or self._shown[1] != self._seconds:
            try:
                self._shown = state, self._seconds, state.at(clip, self._seconds)
            except DermisError as error:  # a frame of a sequence that cannot be read
                self.stop()
                self.note = str(error)
                return state
        return self._shown[2]

    def open(self, motion: MotionFile) -> None:
        """Play another motion.

        Raises DermisError for a file that cannot be read and for one of which the head has no name.
        """
        motion.clip(self._history.state.scene.head)
        self.pause()
        self._motion, self._head = motion, None
        self.play(0.0)

    def play(self, seconds: float | None = None) -> None:
        """Run on from a place, or from where it is; from the beginning when that is the end."""
        if self.clip is None:
            return
        start = self.seconds if seconds is None else seconds
        self._seconds = 0.0 if start >= self.clip.duration_s else start
        self.is_playing, self._starting, self._began = True, True, None

    def stop(self) -> None:
        """End without a step: the state is as it was before."""
        self.is_playing, self._shown = False, None

    def pause(self) -> None:
        """Stop at the pose of now, which is one step."""
        if self.is_playing:
            shown = self.shown
            self.stop()
            self._history.end_gesture()
            self._history.change(shown)

    def toggle(self) -> None:
        """Play or pause."""
        if self.is_playing:
            self.pause()
        else:
            self.play()

    def advance(self) -> None:
        """Go on to the time of the clock, which begins when the first picture is there: it may take long."""
        now, clip = self._clock(), self.clip if self.is_playing else None
        if clip is None or self._starting:
            self.is_playing, self._starting = clip is not None, False
            return
        if self._began is None:
            self._began = now - self._seconds
        self._seconds = now - self._began
        if self.loops and clip.duration_s > 0:
            self._seconds %= clip.duration_s
        elif self._seconds >= clip.duration_s:
            self._seconds = clip.duration_s
            self.pause()

    def scrubbed(self, seconds: float) -> ViewerState:
        """Stop, and the state at another place [s]; raises DermisError for a frame that cannot be read."""
        self.stop()
        clip, state = self.clip, self._history.state
        return state if clip is None else state.at(clip, seconds)
