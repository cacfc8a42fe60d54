"""Pointer, touch and keyboard input over the picture, converted to changes of the viewer state."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from dermis.apps.viewer.navigation import dolly, drag_light, focus, orbit, pan, pick
from dermis.apps.viewer.state import ATLAS_VIEW_NAME, AtlasView, UndoHistory, ViewerState
from dermis.scene.camera import CAMERA_PRESETS, camera_preset

Event = Mapping[str, Any]
Point = tuple[float, float]
PRESET_NAMES = tuple(CAMERA_PRESETS)
"""Names of the camera presets, in the order of the digit keys that select them, from 1."""
LIGHT_DRAG_KEY = "Shift"
_LOG_DISTANCE_PER_WHEEL_UNIT = 1e-3  # change of the logarithm of the distance per unit of the wheel
_MAX_LOG_DISTANCE_STEP = (
    10.0  # maximum change of that logarithm per event; an event sums all rotations in a frame
)
_LEFT_BUTTON = 1
_DIVIDER_GRAB_RADIUS_PX = 8.0  # distance from the divider within which a pointer grabs it [logical pixel]


class Controls:
    """Handler of pointer, touch and keyboard input over the picture, which changes the viewer state.

    history : undo history, which receives the changed states
    displayed_state : function that returns the state on screen, which differs from the current state of the
        history while a motion plays
    light : index of the light that Shift-drag moves; an index after the last light selects the environment
    """

    def __init__(
        self, history: UndoHistory, displayed_state: Callable[[], ViewerState] | None = None
    ) -> None:
        self.history = history
        self._displayed_state = displayed_state or (lambda: history.state)
        self.light = 0
        self._gesture_count = 0
        self._pressed_button = 0
        self._pointer_position = (0.0, 0.0)
        self._pinch: tuple[float, float, float] | None = None

    def handle(self, event: Event, picture_size: Point) -> None:
        """Process an event over the picture.

        picture_size : logical size of the picture
        """
        kind = event["event_type"]
        if kind == "pointer_down":
            self._press(event)
        elif kind == "pointer_move" and self._pressed_button:
            self._drag(event, picture_size)
        elif kind == "pointer_up":
            self._release(event, picture_size)
        elif kind == "wheel":
            wheel_step = max(
                -_MAX_LOG_DISTANCE_STEP,
                min(_MAX_LOG_DISTANCE_STEP, _LOG_DISTANCE_PER_WHEEL_UNIT * event["dy"]),
            )
            self._zoom(math.exp(wheel_step), (event["x"], event["y"]), picture_size, "wheel")
        elif kind == "double_click":
            self._focus_camera(event, picture_size)
        elif kind == "key_down":
            self._on_key(str(event["key"]), event.get("modifiers", ()))

    def set_camera_preset(self, preset_name: str) -> None:
        """Set the camera to a preset such as "portrait" or "profile"."""
        state = self.history.state
        self.history.end_gesture()
        self.history.change(state.with_camera(camera_preset(preset_name, state.scene.head)))

    def _press(self, event: Event) -> None:
        self.history.end_gesture()
        self._gesture_count += 1
        self._pressed_button = int(event.get("button", 0)) or _LEFT_BUTTON
        self._pointer_position = event["x"], event["y"]
        self._pinch = _measure_pinch(event)

    def _release(self, event: Event, picture_size: Point) -> None:
        """End a drag where the pointer was released."""
        if self._pressed_button and not self._pinch and (event["x"], event["y"]) != self._pointer_position:
            self._drag(event, picture_size)
        self._pressed_button, self._pinch = 0, None
        self.history.end_gesture()

    def _drag(self, event: Event, picture_size: Point) -> None:
        pinch, (x0, y0) = _measure_pinch(event), self._pointer_position
        self._pointer_position = event["x"], event["y"]
        if pinch or self._pinch:
            self._pan_and_zoom(pinch, picture_size)
            return
        state, side = self.history.state, self._drag_unit_length(picture_size)
        right, down = (event["x"] - x0) / side, (event["y"] - y0) / side
        if state.view == ATLAS_VIEW_NAME or self._pressed_button != _LEFT_BUTTON:
            new_state = _pan(state, right, down)
        elif LIGHT_DRAG_KEY in event.get("modifiers", ()):
            new_state = drag_light(state, self.light, math.pi * right, -math.pi * down)
        else:
            new_state = state.with_camera(orbit(state.scene.camera, -math.pi * right, math.pi * down))
        self.history.change(new_state, f"drag {self._gesture_count}")

    def _pan_and_zoom(self, pinch: tuple[float, float, float] | None, picture_size: Point) -> None:
        """Pan and zoom by the motion of two fingers since the last event; do nothing when a finger is lifted.

        pinch : midpoint (x, y) and distance of the two fingers [logical pixel]; None for fewer than two
            fingers
        """
        if pinch and self._pinch:
            (x, y, spread), (x0, y0, spread0) = pinch, self._pinch
            side = self._drag_unit_length(picture_size)
            new_state = _pan(self.history.state, (x - x0) / side, (y - y0) / side)
            self.history.change(new_state, f"drag {self._gesture_count}")
            self._zoom(spread0 / spread, (x, y), picture_size, f"drag {self._gesture_count}")
        self._pinch = pinch

    def _zoom(self, distance_factor: float, pointer: Point, picture_size: Point, gesture_name: str) -> None:
        """Move the camera nearer or farther; in the atlas view, scale the atlas around the pointer.

        distance_factor : factor by which the visible height is multiplied; a factor below 1 zooms in
        pointer : position of the pointer in the picture [logical pixel]
        picture_size : width and height of the picture [logical pixel]
        gesture_name : name of the gesture; all changes by one gesture are undone together
        """
        state = self.history.state
        if state.view == ATLAS_VIEW_NAME:
            x, y = (
                (a - 0.5 * b) / self._drag_unit_length(picture_size)
                for a, b in zip(pointer, picture_size, strict=True)
            )
            new_state = state.with_atlas_view(state.atlas_view.zoomed(distance_factor, x, y))
        else:
            new_state = state.with_camera(dolly(state.scene.camera, distance_factor))
        self.history.change(new_state, gesture_name)

    def _drag_unit_length(self, picture_size: Point) -> float:
        """Return the unit of length for drags [logical pixel].

        The unit is the height of the picture or, in the atlas view, the shorter side of the picture.
        """
        return max(1.0, min(picture_size) if self.history.state.view == ATLAS_VIEW_NAME else picture_size[1])

    def _focus_camera(self, event: Event, picture_size: Point) -> None:
        state, (width, height) = self.history.state, picture_size
        if state.view == ATLAS_VIEW_NAME:
            self.history.change(state.with_atlas_view(AtlasView(state.atlas_view.layer)))
            return
        x, y = 2.0 * event["x"] / width - 1.0, 1.0 - 2.0 * event["y"] / height
        point = pick(self._displayed_state().scene, state.scene.camera, x, y, width / height)
        if point is not None:
            self.history.change(state.with_camera(focus(state.scene.camera, point)))

    def _on_key(self, key_name: str, modifiers: Iterable[str]) -> None:
        if "Control" in modifiers or "Meta" in modifiers:
            if key_name.lower() == "z":
                self.history.redo() if "Shift" in modifiers else self.history.undo()
            elif key_name.lower() == "y":
                self.history.redo()
        elif key_name.isdigit() and 0 < int(key_name) <= len(PRESET_NAMES):
            self.set_camera_preset(PRESET_NAMES[int(key_name) - 1])


class SplitView:
    """Before/after comparison: the picture is divided by a vertical line, the divider.

    To its left is a frozen state; to its right is the live state, which the user changes.

    frozen_state : state to the left of the divider, rendered with the live camera; None without a divider
    divider_position : fraction of the picture's width that lies to the left of the divider
    is_dragged : whether the divider is being dragged
    """

    def __init__(self) -> None:
        self.frozen_state: ViewerState | None = None
        self.divider_position = 0.5
        self.is_dragged = False

    def freeze(self, state: ViewerState) -> None:
        """Freeze a state, and show it to the left of a divider."""
        self.frozen_state = state

    def release(self) -> None:
        """End the comparison: discard the frozen state, and show the live state without a divider."""
        self.frozen_state, self.is_dragged = None, False

    def handle(self, event: Event, picture_width: float) -> bool:
        """Process a pointer event; return whether it drags the divider.

        picture_width : logical width of the picture
        """
        kind = event["event_type"]
        if kind == "pointer_down" and self.frozen_state:
            self.is_dragged = (
                abs(event["x"] - self.divider_position * picture_width) <= _DIVIDER_GRAB_RADIUS_PX
            )
        elif kind in ("pointer_move", "pointer_up") and self.is_dragged:
            self.divider_position = min(1.0, max(0.0, event["x"] / max(1.0, picture_width)))
            self.is_dragged = kind == "pointer_move"
            return True
        return self.is_dragged


def picture_event(event: Event, picture_left: float) -> Event:
    """Convert an event from window to picture coordinates, by subtracting the left edge of the picture."""
    shifted = dict(event)
    if "x" in shifted:
        shifted["x"] -= picture_left
    if shifted.get("touches"):
        touches = shifted["touches"].items()
        shifted["touches"] = {key: touch | {"x": touch["x"] - picture_left} for key, touch in touches}
    return shifted


def _pan(state: ViewerState, right_shift: float, down_shift: float) -> ViewerState:
    """Return the state with the camera, or the displayed part of the atlas, moved by a drag of the pointer.

    right_shift : motion of the pointer to the right, in units of `Controls._drag_unit_length`
    down_shift : motion of the pointer downwards, in the same units
    """
    if state.view == ATLAS_VIEW_NAME:
        return state.with_atlas_view(state.atlas_view.panned(right_shift, down_shift))
    return state.with_camera(pan(state.scene.camera, -right_shift, down_shift))


def _measure_pinch(event: Event) -> tuple[float, float, float] | None:
    """Return the midpoint (x, y) and the distance of two fingers; None for fewer than two fingers."""
    touches = list((event.get("touches") or {}).values())
    if len(touches) < 2:
        return None
    a, b = touches[:2]
    spread = math.hypot(a["x"] - b["x"], a["y"] - b["y"])
    return 0.5 * (a["x"] + b["x"]), 0.5 * (a["y"] + b["y"]), max(1.0, spread)
