"""Events of a window as Dear ImGui takes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

_WHEEL = 0.01
_POINTER = ("pointer_down", "pointer_move", "pointer_up", "double_click")


def feed(io: Any, event: Mapping[str, Any], covers: Callable[[float, float], bool]) -> bool:
    """Hand an event on; returns whether Dear ImGui wants it.

    covers : whether a pointer at a place is the panel's
    """
    kind = event["event_type"]
    if kind in _POINTER or kind == "wheel":
        io.add_mouse_pos_event(event["x"], event["y"])
        if kind in ("pointer_down", "pointer_up"):
            io.add_mouse_button_event(max(0, event["button"] - 1), kind == "pointer_down")
        elif kind == "wheel":
            io.add_mouse_wheel_event(-_WHEEL * event["dx"], -_WHEEL * event["dy"])
        return covers(event["x"], event["y"])
    if kind == "pointer_leave":
        io.add_mouse_pos_event(-1e6, -1e6)
    elif kind in ("key_down", "key_up"):
        _feed_key(io, str(event["key"]), kind == "key_down")
        return bool(io.want_text_input)
    elif kind == "char":
        io.add_input_characters_utf8(event.get("data") or event.get("char_str") or "")
        return bool(io.want_text_input)
    return False


def shifted(event: Mapping[str, Any], left: float) -> dict[str, Any]:
    """The event as a part of the window sees it that begins so far from its left edge."""
    found = dict(event)
    if "x" in found:
        found["x"] -= left
    if found.get("touches"):
        touches = found["touches"].items()
        found["touches"] = {key: touch | {"x": touch["x"] - left} for key, touch in touches}
    return found


def _feed_key(io: Any, name: str, down: bool) -> None:
    from imgui_bundle import imgui
    from wgpu.utils.imgui import ImguiRenderer

    key = ImguiRenderer.KEY_MAP.get(name)
    if key is None and len(name) == 1 and name.isascii() and name.isalnum():
        known = f"_{name}" if name.isdigit() else name.lower()
        key = getattr(imgui.Key, known, None)
    if key is not None:
        io.add_key_event(key, down)
    if name in ImguiRenderer.KEY_MAP_MOD:
        io.add_key_event(ImguiRenderer.KEY_MAP_MOD[name], down)
