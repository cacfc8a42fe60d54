"""What is drawn over the picture: the divider, messages, and the list of shortcuts."""

from __future__ import annotations

from collections.abc import Sequence

from imgui_bundle import imgui

from dermis.apps.viewer.controls import Split

HELP_KEYS = ("?", "h", "H", "F1")
"""Keys that show and hide the list of shortcuts."""

PLAY_KEY = " "
"""Key that plays and pauses the motion."""

SHORTCUTS = (
    ("drag", "orbit the head"),
    ("right drag, two fingers", "pan"),
    ("wheel, pinch", "zoom"),
    ("double click", "orbit around that point"),
    ("Shift and drag", "move the selected light or the environment"),
    ("1 2 3 4 5", "portrait, three-quarter, profile, ear, cheek"),
    ("space", "play or pause the motion"),
    ("Ctrl+Z, Ctrl+Y", "undo, redo"),
    ("Ctrl and click", "type a slider's value"),
    ("Ctrl+S", "save the scene"),
    ("Tab", "hide or show the panel"),
    ("Escape", "close a list or this help, clear the search"),
    ("? or H", "hide or show this help"),
)
_MARGIN, _NARROWEST_TEXT = 10.0, 80.0
_GRIP = 7.0  # radius of the divider's handle
_WIDEST_HELP, _FIRST_COLUMN = 460.0, 0.4


def draw_divider(split: Split, left: float, size: tuple[float, float]) -> None:
    """Draw the line between before and after, with a handle in its middle.

    left : where the picture begins
    size : of the window, logical
    """
    if split.before is None:
        return
    over, x = imgui.get_background_draw_list(), left + split.share * (size[0] - left)
    light, dark = imgui.IM_COL32(230, 230, 230, 255), imgui.IM_COL32(0, 0, 0, 255)
    over.add_line(imgui.ImVec2(x, 0.0), imgui.ImVec2(x, size[1]), light, 1.0)
    middle = imgui.ImVec2(x, 0.5 * size[1])
    over.add_circle_filled(middle, _GRIP, light)
    over.add_circle(middle, _GRIP, dark)
    for text, start in (("before", x - imgui.calc_text_size("before").x - _MARGIN), ("after", x + _MARGIN)):
        over.add_text(imgui.ImVec2(start + 1.0, _MARGIN + 1.0), dark, text)
        over.add_text(imgui.ImVec2(start, _MARGIN), light, text)


def draw_messages(lines: Sequence[str], left: float, size: tuple[float, float]) -> None:
    """Draw lines of text on a dark ground at the lower edge of the picture, which begins at `left`."""
    if not lines:
        return
    over = imgui.get_foreground_draw_list()
    left += _MARGIN
    wrapped = max(_NARROWEST_TEXT, size[0] - left - _MARGIN)
    text = "\n".join(lines)
    box = imgui.calc_text_size(text, False, wrapped)
    top = size[1] - box.y - _MARGIN
    ground, white = imgui.IM_COL32(0, 0, 0, 150), imgui.IM_COL32(235, 235, 235, 255)
    corners = imgui.ImVec2(left - 6, top - 4), imgui.ImVec2(left + box.x + 6, size[1] - 6)
    over.add_rect_filled(*corners, ground, 4.0)
    font, start = imgui.get_font(), imgui.ImVec2(left, top)
    over.add_text(font, imgui.get_font_size(), start, white, text, wrapped)


def draw_help(left: float, size: tuple[float, float]) -> None:
    """Draw the shortcuts in the middle of the picture, which begins at `left`; pointers pass through.

    size : of the window, logical
    """
    width = min(_WIDEST_HELP, size[0] - left - 2.0 * _MARGIN)
    imgui.set_next_window_pos(imgui.ImVec2(0.5 * (left + size[0]), 0.5 * size[1]), 0, imgui.ImVec2(0.5, 0.5))
    imgui.set_next_window_size(imgui.ImVec2(width, 0.0))
    imgui.set_next_window_bg_alpha(0.88)
    flags = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_inputs | imgui.WindowFlags_.no_nav
    imgui.begin("shortcuts", None, int(flags))
    if imgui.begin_table("shortcuts", 2, int(imgui.TableFlags_.sizing_stretch_prop)):
        stretch = int(imgui.TableColumnFlags_.width_stretch)
        imgui.table_setup_column("input", stretch, _FIRST_COLUMN)
        imgui.table_setup_column("action", stretch, 1.0 - _FIRST_COLUMN)
        for text in (text for row in SHORTCUTS for text in row):
            imgui.table_next_column()
            imgui.text_wrapped(text)
        imgui.end_table()
    imgui.end()
