"""Input events for Dear ImGui."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from imgui_bundle import imgui
from wgpu.utils.imgui import ImguiRenderer

POINTER = ("pointer_down", "pointer_move", "pointer_up", "double_click", "wheel")
_WHEEL = 0.01


def feed_pointer(event: Mapping[str, Any], frame: Callable[[], None]) -> None:
    """Process an event of `POINTER`.

    frame : lays out the panel with the events so far
    """
    kind = event["event_type"]
    imgui.get_io().add_mouse_pos_event(event["x"], event["y"])
    if kind in ("pointer_down", "pointer_up"):
        # A slider ignores a move in the frame of its release, and a press is where that frame's last move is.
        frame()  # which may take another context, with other inputs
        imgui.get_io().add_mouse_button_event(max(0, event["button"] - 1), kind == "pointer_down")
        frame()
    elif kind == "wheel":
        imgui.get_io().add_mouse_wheel_event(-_WHEEL * event["dx"], -_WHEEL * event["dy"])


def feed_key(event: Mapping[str, Any], frame: Callable[[], None]) -> None:
    """Process a key or a letter; it is seen in a frame of its own, as keys between two frames cancel out.

    frame : as above
    """
    io, kind = imgui.get_io(), event["event_type"]
    if kind == "char":
        io.add_input_characters_utf8(event.get("data") or event.get("char_str") or "")
    else:
        _change_key(io, str(event["key"]), kind == "key_down")
    frame()


def _change_key(io: Any, name: str, down: bool) -> None:
    key = ImguiRenderer.KEY_MAP.get(name)
    if key is None and len(name) == 1 and name.isascii() and name.isalnum():
        key = getattr(imgui.Key, f"_{name}" if name.isdigit() else name.lower(), None)
    if key is not None:
        io.add_key_event(key, down)
    if name in ImguiRenderer.KEY_MAP_MOD:
        io.add_key_event(ImguiRenderer.KEY_MAP_MOD[name], down)
