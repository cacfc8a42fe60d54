"""The undo history of the viewer's states."""

from __future__ import annotations

from dermis.apps.viewer.state import ViewerState, same

_MOST_STEPS = 200


class History:
    """Undo history of states.

    A gesture (a drag, a slider held down) changes the state many times and is undone in one step.
    """

    def __init__(self, state: ViewerState) -> None:
        self._past = [state]
        self._undone: list[ViewerState] = []
        self._gesture = ""

    @property
    def state(self) -> ViewerState:
        """The current state."""
        return self._past[-1]

    @property
    def states(self) -> list[ViewerState]:
        """All states, those that were undone included."""
        return [*self._past, *self._undone]

    @property
    def can_undo(self) -> bool:
        """Whether there is an earlier state."""
        return len(self._past) > 1

    @property
    def can_redo(self) -> bool:
        """Whether the last step was an undo."""
        return bool(self._undone)

    def change(self, state: ViewerState, gesture: str = "") -> None:
        """Add a state; during one gesture it replaces the last one."""
        if same(state, self.state):
            return
        if gesture and gesture == self._gesture:
            self._past[-1] = state
        else:
            self._past.append(state)
            del self._past[: -_MOST_STEPS - 1]
        self._gesture = gesture
        self._undone.clear()

    def end_gesture(self) -> None:
        """Make the next change a step of its own."""
        self._gesture = ""

    def undo(self) -> None:
        """Go back one step."""
        self.end_gesture()
        if self.can_undo:
            self._undone.append(self._past.pop())

    def redo(self) -> None:
        """Repeat the step undone last."""
        self.end_gesture()
        if self._undone:
            self._past.append(self._undone.pop())
