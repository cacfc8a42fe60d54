"""Before and after: a frozen state on the left of a divider, the live one on its right."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dermis.viewer.state import ViewerState

_REACH = 8.0  # logical pixels to either side of the divider in which a pointer takes hold of it


class Split:
    """The state that is frozen, and where the divider is.

    before : what the left side shows, seen by the live camera; None for no divider
    share : of the picture's width that lies to the left
    """

    def __init__(self) -> None:
        self.before: ViewerState | None = None
        self.share = 0.5
        self.held = False

    def freeze(self, state: ViewerState) -> None:
        """Keep a state for the left side."""
        self.before = state

    def release(self) -> None:
        """Show the live state alone."""
        self.before, self.held = None, False

    def handle(self, event: Mapping[str, Any], width: float) -> bool:
        """Follow a pointer over a picture of that width; returns whether the divider took it."""
        kind = event["event_type"]
        if kind == "pointer_down" and self.before:
            self.held = abs(event["x"] - self.share * width) <= _REACH
        elif kind == "pointer_move" and self.held:
            self.share = min(1.0, max(0.0, event["x"] / max(1.0, width)))
        elif kind == "pointer_up" and self.held:
            self.held = False
            return True
        return self.held
