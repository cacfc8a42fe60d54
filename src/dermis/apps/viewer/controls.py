"""Pointer, touch and keyboard input over the picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from dermis.apps.viewer.navigation import dolly, drag_light, focus, orbit, pan, pick
from dermis.apps.viewer.state import ATLAS, Chart, History, ViewerState
from dermis.scene.camera import preset

Event = Mapping[str, Any]
Pair = tuple[float, float]
CAMERAS = ("portrait", "three-quarter", "profile", "ear", "cheek")
"""Camera presets of the keys 1 to 5."""
LIGHT_KEY = "Shift"
_WHEEL = 1e-3  # change of the logarithm of the distance per unit of the wheel
_MOST_WHEEL = 10.0  # of that logarithm in one frame, for which all turns are summed
_LEFT = 1
_GRAB = 8.0  # logical pixels to either side of the divider within which a pointer grabs it


class Controls:
    """Turns input events into steps of the undo history.

    shown : returns the state that is seen, where that is not the history's
    light : index of the light that Shift and drag moves; an index past the last one means the environment
    """

    def __init__(self, history: History, shown: Callable[[], ViewerState] | None = None) -> None:
        self.history = history
        self._shown = shown or (lambda: history.state)
        self.light = 0
        self._gesture = 0
        self._button = 0
        self._at = (0.0, 0.0)
        self._pinch: tuple[float, float, float] | None = None

    def handle(self, event: Event, size: Pair) -> None:
        """Process an event; `size` is that of the picture, logical."""
        kind = event["event_type"]
        if kind == "pointer_down":
            self._begin(event)
        elif kind == "pointer_move" and self._button:
            self._drag(event, size)
        elif kind == "pointer_up":
            self._end(event, size)
        elif kind == "wheel":
            turned = max(-_MOST_WHEEL, min(_MOST_WHEEL, _WHEEL * event["dy"]))
            self._zoom(math.exp(turned), (event["x"], event["y"]), size, "wheel")
        elif kind == "double_click":
            self._focus(event, size)
        elif kind == "key_down":
            self._key(str(event["key"]), event.get("modifiers", ()))

    def look(self, name: str) -> None:
        """Go to a camera preset."""
        state = self.history.state
        self.history.end_gesture()
        self.history.change(state.with_camera(preset(name, state.scene.head)))

    def _begin(self, event: Event) -> None:
        self.history.end_gesture()
        self._gesture += 1
        self._button = int(event.get("button", 0)) or _LEFT
        self._at = event["x"], event["y"]
        self._pinch = _pinch(event)

    def _end(self, event: Event, size: Pair) -> None:
        """Let go where the pointer is, to which no move may have led."""
        if self._button and not self._pinch and (event["x"], event["y"]) != self._at:
            self._drag(event, size)
        self._button, self._pinch = 0, None
        self.history.end_gesture()

    def _drag(self, event: Event, size: Pair) -> None:
        pinch, (x0, y0) = _pinch(event), self._at
        self._at = event["x"], event["y"]
        if pinch or self._pinch:
            self._two_fingers(pinch, size)
            return
        state, side = self.history.state, self._side(size)
        right, down = (event["x"] - x0) / side, (event["y"] - y0) / side
        if state.view == ATLAS or self._button != _LEFT:
            moved = _panned(state, right, down)
        elif LIGHT_KEY in event.get("modifiers", ()):
            moved = drag_light(state, self.light, math.pi * right, -math.pi * down)
        else:
            moved = state.with_camera(orbit(state.scene.camera, -math.pi * right, math.pi * down))
        self.history.change(moved, f"drag {self._gesture}")

    def _two_fingers(self, pinch: tuple[float, float, float] | None, size: Pair) -> None:
        """Pan and zoom; a finger that is lifted must not make the picture jump."""
        if pinch and self._pinch:
            (x, y, spread), (x0, y0, spread0) = pinch, self._pinch
            side = self._side(size)
            moved = _panned(self.history.state, (x - x0) / side, (y - y0) / side)
            self.history.change(moved, f"drag {self._gesture}")
            self._zoom(spread0 / spread, (x, y), size, f"drag {self._gesture}")
        self._pinch = pinch

    def _zoom(self, factor: float, at: Pair, size: Pair, gesture: str) -> None:
        """Dolly the camera, or scale the atlas around the pointer."""
        state = self.history.state
        if state.view == ATLAS:
            x, y = ((a - 0.5 * b) / self._side(size) for a, b in zip(at, size, strict=True))
            moved = state.with_chart(state.chart.zoomed(factor, x, y))
        else:
            moved = state.with_camera(dolly(state.scene.camera, factor))
        self.history.change(moved, gesture)

    def _side(self, size: Pair) -> float:
        """Return the unit of drags: the picture's height, for the atlas its shorter side."""
        return max(1.0, min(size) if self.history.state.view == ATLAS else size[1])

    def _focus(self, event: Event, size: Pair) -> None:
        state, (width, height) = self.history.state, size
        if state.view == ATLAS:
            self.history.change(state.with_chart(Chart(state.chart.layer)))
            return
        x, y = 2.0 * event["x"] / width - 1.0, 1.0 - 2.0 * event["y"] / height
        point = pick(self._shown().scene, state.scene.camera, x, y, width / height)
        if point is not None:
            self.history.change(state.with_camera(focus(state.scene.camera, point)))

    def _key(self, key: str, modifiers: Iterable[str]) -> None:
        if "Control" in modifiers or "Meta" in modifiers:
            if key.lower() == "z":
                self.history.redo() if "Shift" in modifiers else self.history.undo()
            elif key.lower() == "y":
                self.history.redo()
        elif key.isdigit() and 0 < int(key) <= len(CAMERAS):
            self.look(CAMERAS[int(key) - 1])


class Split:
    """A before/after comparison: a frozen state left of a divider, the live one right of it.

    before : the state on the left, seen by the live camera; None for no divider
    share : of the picture's width left of the divider
    """

    def __init__(self) -> None:
        self.before: ViewerState | None = None
        self.share = 0.5
        self.held = False

    def freeze(self, state: ViewerState) -> None:
        """Put a state on the left side."""
        self.before = state

    def release(self) -> None:
        """Show the live state alone."""
        self.before, self.held = None, False

    def handle(self, event: Event, width: float) -> bool:
        """Process a pointer event over a picture of that width; returns whether the divider took it."""
        kind = event["event_type"]
        if kind == "pointer_down" and self.before:
            self.held = abs(event["x"] - self.share * width) <= _GRAB
        elif kind in ("pointer_move", "pointer_up") and self.held:
            self.share = min(1.0, max(0.0, event["x"] / max(1.0, width)))
            self.held = kind == "pointer_move"
            return True
        return self.held


def shifted(event: Event, left: float) -> Event:
    """Return an event in the coordinates of a picture that begins at `left` in the window."""
    found = dict(event)
    if "x" in found:
        found["x"] -= left
    if found.get("touches"):
        touches = found["touches"].items()
        found["touches"] = {key: touch | {"x": touch["x"] - left} for key, touch in touches}
    return found


def _panned(state: ViewerState, right: float, down: float) -> ViewerState:
    """Return the state with the camera or the atlas moved along with the pointer."""
    if state.view == ATLAS:
        return state.with_chart(state.chart.panned(right, down))
    return state.with_camera(pan(state.scene.camera, -right, down))


def _pinch(event: Event) -> tuple[float, float, float] | None:
    """Return midpoint and distance of two fingers; None for fewer."""
    touches = list((event.get("touches") or {}).values())
    if len(touches) < 2:
        return None
    a, b = touches[:2]
    spread = math.hypot(a["x"] - b["x"], a["y"] - b["y"])
    return 0.5 * (a["x"] + b["x"]), 0.5 * (a["y"] + b["y"]), max(1.0, spread)
