"""The row of buttons over the sections, and the one that brings a hidden panel back."""

from __future__ import annotations

from imgui_bundle import imgui

from dermis.viewer.desk import Desk
from dermis.viewer.panel.fields import button

_CORNER, _FAINT = 8.0, 0.6


def draw_toolbar(desk: Desk) -> str:
    """Undo and redo; returns "help" or "hide" when that was pressed."""
    for label, possible, step in (
        ("undo", desk.history.can_undo, desk.history.undo),
        ("redo", desk.history.can_redo, desk.history.redo),
    ):
        imgui.begin_disabled(not possible)
        if button(desk, label):
            step()
        imgui.end_disabled()
        imgui.same_line()
    found = "help" if button(desk, "help") else ""
    imgui.same_line()
    return "hide" if button(desk, "hide") else found


def draw_handle(desk: Desk) -> tuple[bool, tuple[float, float]]:
    """A button in the corner of the picture: whether it was pressed, and how far it reaches."""
    imgui.set_next_window_pos(imgui.ImVec2(0.0, 0.0))
    flags = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_background
    imgui.push_style_var(int(imgui.StyleVar_.alpha), _FAINT)
    imgui.begin("handle", None, int(flags | imgui.WindowFlags_.always_auto_resize))
    pressed = button(desk, "panel")
    end = imgui.get_item_rect_max()
    imgui.end()
    imgui.pop_style_var()
    return pressed, (float(end.x) + _CORNER, float(end.y) + _CORNER)
