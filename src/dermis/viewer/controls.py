"""Pointer, touch and keys to changes of the state."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from dermis.scene.camera import preset
from dermis.viewer.chart import ATLAS
from dermis.viewer.history import History
from dermis.viewer.lamp import drag_light
from dermis.viewer.orbit import dolly, focus, orbit, pan
from dermis.viewer.picking import pick

Event = Mapping[str, Any]
Place = tuple[float, float]
CAMERAS = ("portrait", "three-quarter", "profile", "ear", "cheek")
"""Presets by the keys 1 to 5."""
LIGHT_KEY = "Shift"
_WHEEL = 1e-3  # of the logarithm of the distance, for each unit that the wheel turns
_LEFT = 1


class Controls:
    """Turns events of a window into steps of a history.

    light : index of the light that is dragged with Shift; beyond the last one it is the environment
    """

    def __init__(self, history: History) -> None:
        self.history = history
        self.light = 0
        self._gesture = 0
        self._button = 0
        self._at = (0.0, 0.0)
        self._pinch: tuple[float, float, float] | None = None

    @property
    def dragging(self) -> bool:
        """Whether a button or a finger is down on the picture."""
        return self._button > 0

    def handle(self, event: Event, size: tuple[float, float]) -> None:
        """Follow an event of a window of that logical size."""
        kind = event["event_type"]
        if kind == "pointer_down":
            self._begin(event)
        elif kind == "pointer_move":
            self._move(event, size)
        elif kind == "pointer_up":
            self._end()
        elif kind == "wheel":
            self._nearer(math.exp(_WHEEL * event["dy"]), (event["x"], event["y"]), size, "wheel")
        elif kind == "double_click":
            self._focus(event, size)
        elif kind == "key_down":
            self._key(str(event["key"]), event.get("modifiers", ()))

    def _begin(self, event: Event) -> None:
        self.history.end_gesture()
        self._gesture += 1
        self._button = int(event.get("button", 0)) or _LEFT
        self._at = event["x"], event["y"]
        self._pinch = _pinch(event)

    def _end(self) -> None:
        self._button, self._pinch = 0, None
        self.history.end_gesture()

    def _move(self, event: Event, size: tuple[float, float]) -> None:
        if not self.dragging:
            return
        pinch = _pinch(event)
        if pinch or self._pinch:
            self._two_fingers(pinch, size)
            self._at = event["x"], event["y"]
            return
        state, side = self.history.state, self._side(size)
        right, down = (event["x"] - self._at[0]) / side, (event["y"] - self._at[1]) / side
        self._at = event["x"], event["y"]
        if state.view == ATLAS:
            moved = state.with_chart(state.chart.panned(right, down))
        elif self._button != _LEFT:
            moved = state.with_camera(pan(state.scene.camera, -right, down))
        elif LIGHT_KEY in event.get("modifiers", ()):
            moved = drag_light(state, self.light, math.pi * right, -math.pi * down)
        else:
            moved = state.with_camera(orbit(state.scene.camera, -math.pi * right, math.pi * down))
        self.history.change(moved, f"drag {self._gesture}")

    def _two_fingers(self, pinch: tuple[float, float, float] | None, size: tuple[float, float]) -> None:
        """Fingers that part come nearer, that move together pan; one that leaves ends it without a jump."""
        if pinch and self._pinch:
            (x, y, spread), (x0, y0, spread0) = pinch, self._pinch
            state, side = self.history.state, self._side(size)
            right, down = (x - x0) / side, (y - y0) / side
            if state.view == ATLAS:
                moved = state.with_chart(state.chart.panned(right, down))
            else:
                moved = state.with_camera(pan(state.scene.camera, -right, down))
            self.history.change(moved, f"drag {self._gesture}")
            self._nearer(spread0 / spread, (x, y), size, f"drag {self._gesture}")
        self._pinch = pinch

    def _nearer(self, factor: float, at: Place, size: Place, gesture: str) -> None:
        """The camera goes towards its target, the atlas grows around the pointer."""
        state = self.history.state
        if state.view == ATLAS:
            x, y = ((a - 0.5 * b) / self._side(size) for a, b in zip(at, size, strict=True))
            moved = state.with_chart(state.chart.zoomed(factor, x, y))
        else:
            moved = state.with_camera(dolly(state.scene.camera, factor))
        self.history.change(moved, gesture)

    def _side(self, size: Place) -> float:
        """What shares of a picture are shares of: its height, of the atlas the shorter side."""
        return max(1.0, min(size) if self.history.state.view == ATLAS else size[1])

    def _focus(self, event: Event, size: tuple[float, float]) -> None:
        state, (width, height) = self.history.state, size
        if state.view == ATLAS:
            self.history.change(state.with_chart(state.chart.whole()))
            return
        x, y = 2.0 * event["x"] / width - 1.0, 1.0 - 2.0 * event["y"] / height
        place = pick(state.scene.head, state.scene.camera, x, y, width / height)
        if place is not None:
            self.history.change(state.with_camera(focus(state.scene.camera, place)))

    def _key(self, key: str, modifiers: Any) -> None:
        if "Control" in modifiers or "Meta" in modifiers:
            if key.lower() == "z":
                self.history.redo() if "Shift" in modifiers else self.history.undo()
            elif key.lower() == "y":
                self.history.redo()
        elif key.isdigit() and 0 < int(key) <= len(CAMERAS):
            self.look(CAMERAS[int(key) - 1])

    def look(self, name: str) -> None:
        """From a preset's place."""
        state = self.history.state
        self.history.end_gesture()
        self.history.change(state.with_camera(preset(name, state.scene.head)))


def _pinch(event: Event) -> tuple[float, float, float] | None:
    """Middle and distance of two fingers; None for fewer."""
    touches = list((event.get("touches") or {}).values())
    if len(touches) < 2:
        return None
    a, b = touches[:2]
    spread = math.hypot(a["x"] - b["x"], a["y"] - b["y"])
    return 0.5 * (a["x"] + b["x"]), 0.5 * (a["y"] + b["y"]), max(1.0, spread)
