"""Heartbeat of the displayed person, which depends on a clock and is not part of the viewer state."""

from __future__ import annotations

from collections.abc import Callable

from dermis.apps.viewer.state import ViewerState
from dermis.scene.living import is_living_head
from dermis.scene.pulse import Pulse

_RESTART_S = 3600.0  # a pulse has a limited duration


class Heartbeat:
    """Heartbeat that changes the skin of the displayed person with time.

    clock : function that returns the time [s]
    pulse : pulse that is shown, or None
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self.pulse: Pulse | None = None
        self._clock, self._start_s, self._seconds = clock, clock(), 0.0
        self._cached_display: tuple[ViewerState, Pulse, float, ViewerState] | None = None

    def advance(self) -> None:
        """Advance the pulse to the current time of the clock."""
        self._seconds = (self._clock() - self._start_s) % _RESTART_S

    def is_running(self, state: ViewerState) -> bool:
        """Return whether the picture of a state changes with the pulse."""
        return self.pulse is not None and is_living_head(state.scene.head, state.scene.skin.albedo)

    def displayed(self, state: ViewerState) -> ViewerState:
        """Return a state at the current time of the pulse, as the same object until state or time change."""
        if self.pulse is None or not self.is_running(state):
            return state
        cached = self._cached_display
        if cached is None or cached[0] is not state or cached[1:3] != (self.pulse, self._seconds):
            moved = state.with_pulse(self.pulse, self._seconds)
            self._cached_display = cached = state, self.pulse, self._seconds, moved
        return cached[3]
