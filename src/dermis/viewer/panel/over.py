"""What is drawn over the picture: the divider, and lines of text at the lower edge."""

from __future__ import annotations

from collections.abc import Sequence

from imgui_bundle import imgui

from dermis.viewer.split import Split

_MARGIN, _NARROWEST_TEXT = 10.0, 80.0
_GRIP = 7.0  # half the height of the divider's handle


def draw_divider(split: Split, left: float, size: tuple[float, float]) -> None:
    """A line between before and after, with a handle in its middle.

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
    for text, place in (("before", x - imgui.calc_text_size("before").x - _MARGIN), ("after", x + _MARGIN)):
        over.add_text(imgui.ImVec2(place + 1.0, _MARGIN + 1.0), dark, text)
        over.add_text(imgui.ImVec2(place, _MARGIN), light, text)


def draw_lines(lines: Sequence[str], left: float, size: tuple[float, float]) -> None:
    """Lines at the lower edge of the picture, which begins at `left`, on a shade."""
    if not lines:
        return
    over = imgui.get_foreground_draw_list()
    left += _MARGIN
    wrapped = max(_NARROWEST_TEXT, size[0] - left - _MARGIN)
    text = "\n".join(lines)
    box = imgui.calc_text_size(text, False, wrapped)
    top = size[1] - box.y - _MARGIN
    shade, white = imgui.IM_COL32(0, 0, 0, 150), imgui.IM_COL32(235, 235, 235, 255)
    corners = imgui.ImVec2(left - 6, top - 4), imgui.ImVec2(left + box.x + 6, size[1] - 6)
    over.add_rect_filled(*corners, shade, 4.0)
    font, place = imgui.get_font(), imgui.ImVec2(left, top)
    over.add_text(font, imgui.get_font_size(), place, white, text, wrapped)
