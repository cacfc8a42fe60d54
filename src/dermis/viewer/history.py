"""Undo and redo over states; what belongs to one gesture is one step."""

from __future__ import annotations

from dermis.viewer.state import ViewerState, same

_MOST_STEPS = 200


class History:
    """The states up to now and those that were undone.

    A gesture (a drag, a slider that is held) changes the state many times and is undone at once.
    """

    def __init__(self, state: ViewerState) -> None:
        self._past = [state]
        self._undone: list[ViewerState] = []
        self._gesture = ""

    @property
    def state(self) -> ViewerState:
        """Of now."""
        return self._past[-1]

    @property
    def states(self) -> list[ViewerState]:
        """All that it holds."""
        return [*self._past, *self._undone]

    @property
    def can_undo(self) -> bool:
        """Whether there is an earlier state."""
        return len(self._past) > 1

    @property
    def can_redo(self) -> bool:
        """Whether something was undone last."""
        return bool(self._undone)

    def change(self, state: ViewerState, gesture: str = "") -> None:
        """Go on to a state; while the gesture is the same it takes the place of the last one."""
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
        """The next change is a step of its own."""
        self._gesture = ""

    def undo(self) -> None:
        """Back by one step."""
        self.end_gesture()
        if self.can_undo:
            self._undone.append(self._past.pop())

    def redo(self) -> None:
        """Forth by one step that was undone."""
        self.end_gesture()
        if self._undone:
            self._past.append(self._undone.pop())
