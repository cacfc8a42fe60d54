"""Playback of a motion in the viewer; pausing the motion adds the current pose to the undo history."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from dermis.apps.viewer.state import UndoHistory, ViewerState
from dermis.base.errors import DermisError
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head
from dermis.scene.motion import load_motion


class MotionFile:
    """Motion file, with a cache of the clip last loaded from it.

    path : file that `load_motion` accepts
    fps : frame rate to assume if the file contains no times [1/s]
    """

    def __init__(self, motion_path: str | Path, fps: float | None = None) -> None:
        self.path, self._fps = str(motion_path), fps
        self._last: tuple[Head, Clip] | None = None

    def load_clip(self, head: Head) -> Clip:
        """Return the clip in the file, loaded for a head; the clip for the last head is cached.

        Raises DermisError if the file cannot be read, or if the motion moves no morph target or bone of the
        head.
        """
        if self._last is None or self._last[0] is not head:
            self._last = head, load_motion(self.path, head, fps=self._fps)
        return self._last[1]


class MotionPlayer:
    """Player that keeps track of the current time in a motion and of the state to display.

    While the motion plays, its current pose is displayed instead of the pose of the viewer state; everything
    else in the state can be changed. When the motion pauses or ends, its current pose becomes a step of the
    undo history.

    motion : motion to play; None if there is no motion
    clock : function that returns the time [s]

    is_playing : whether the motion plays
    loops : whether the motion restarts at its end
    note : names in the motion that the head lacks, or the reason why the motion cannot be played
    """

    def __init__(
        self,
        history: UndoHistory,
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
        self._starting = False  # whether no frame of the motion has been drawn yet
        self._start_time: float | None = None  # time of the clock at the beginning of the motion
        self._cached_display: tuple[ViewerState, float, ViewerState] | None = None

    @property
    def has_motion(self) -> bool:
        """Return whether a motion is loaded, even if it cannot be played on the current head."""
        return self._motion is not None

    @property
    def clip(self) -> Clip | None:
        """Return the motion's clip for the current head; None if there is no motion for this head."""
        head = self._history.state.scene.head
        if self._motion is not None and self._head is not head:
            self._head, self._clip = head, None
            try:
                self._clip = self._motion.load_clip(head)
                self.note = self._clip.note
            except DermisError as error:
                self.note = str(error)
        return self._clip

    @property
    def seconds(self) -> float:
        """Return the current time in the motion [s]."""
        return self._seconds if self.is_playing else self._history.state.seconds

    @property
    def displayed_state(self) -> ViewerState:
        """Return the current state, with the motion's current pose while the motion plays."""
        state = self._history.state
        clip = self.clip if self.is_playing else None
        if clip is None:
            return state
        if (
            self._cached_display is None
            or self._cached_display[0] is not state
            or self._cached_display[1] != self._seconds
        ):
            try:
                self._cached_display = state, self._seconds, state.with_motion(clip, self._seconds)
            except DermisError as error:  # an unreadable frame of a sequence
                self.stop()
                self.note = str(error)
                return state
        return self._cached_display[2]

    def open(self, motion: MotionFile) -> None:
        """Replace the motion and play it from its beginning.

        Raises DermisError if the file cannot be read, or if the motion moves no morph target or bone of the
        head.
        """
        motion.load_clip(self._history.state.scene.head)
        self.pause()
        self._motion, self._head = motion, None
        self.play(0.0)

    def play(self, start_s: float | None = None) -> None:
        """Play the motion from a given time; if that time is the end of the motion, play from the beginning.

        start_s : time in the motion to start from; None for the current time [s]
        """
        if self.clip is None:
            return
        start = self.seconds if start_s is None else start_s
        self._seconds = 0.0 if start >= self.clip.duration_s else start
        self.is_playing, self._starting, self._start_time = True, True, None

    def stop(self) -> None:
        """Stop playing, and display the pose of the viewer state instead of the motion's pose."""
        self.is_playing, self._cached_display = False, None

    def pause(self) -> None:
        """Stop playing, and add the current pose to the undo history as one step."""
        if self.is_playing:
            displayed = self.displayed_state
            self.stop()
            self._history.end_gesture()
            self._history.change(displayed)

    def toggle(self) -> None:
        """Pause the motion if it is playing; otherwise play it."""
        if self.is_playing:
            self.pause()
        else:
            self.play()

    def advance(self) -> None:
        """Advance the motion to the current time of the clock.

        The time of the motion starts to run after the first frame, because drawing that frame may take long.
        """
        now, clip = self._clock(), self.clip if self.is_playing else None
        if clip is None or self._starting:
            self.is_playing, self._starting = clip is not None, False
            return
        if self._start_time is None:
            self._start_time = now - self._seconds
        self._seconds = now - self._start_time
        if self.loops and clip.duration_s > 0:
            self._seconds %= clip.duration_s
        elif self._seconds >= clip.duration_s:
            self._seconds = clip.duration_s
            self.pause()

    def state_at(self, time_in_motion_s: float) -> ViewerState:
        """Stop playing, and return the state with the pose that the motion has at a given time.

        time_in_motion_s : time in the motion [s]

        Raises DermisError if the frame at that time cannot be read.
        """
        self.stop()
        clip, state = self.clip, self._history.state
        return state if clip is None else state.with_motion(clip, time_in_motion_s)
