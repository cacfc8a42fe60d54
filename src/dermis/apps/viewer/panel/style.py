"""How the panel looks: its font, and greys."""

from __future__ import annotations

from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui

_FONT_SIZE = 15.0
_GREYS = (  # without hues, which would affect how the skin beside them is judged
    ("window_bg", 0.08),
    ("frame_bg", 0.18),
    ("frame_bg_hovered", 0.26),
    ("frame_bg_active", 0.32),
    ("slider_grab", 0.42),  # dark enough for the number over it
    ("slider_grab_active", 0.55),
    ("check_mark", 0.8),
    ("checkbox_selected_bg", 0.26),
    ("button", 0.26),
    ("button_hovered", 0.36),
    ("button_active", 0.46),
    ("header", 0.22),
    ("header_hovered", 0.32),
    ("header_active", 0.4),
    ("text_selected_bg", 0.4),
    ("nav_cursor", 0.6),
)


def set_style() -> None:
    """A legible font on a dark ground."""
    io, style = imgui.get_io(), imgui.get_style()
    font = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
    if font.is_file():
        io.fonts.add_font_from_file_ttf(str(font), _FONT_SIZE)
    imgui.style_colors_dark()
    io.fonts.flags |= int(imgui.ImFontAtlasFlags_.no_baked_lines)  # some backends cannot draw them
    style.window_rounding, style.frame_rounding, style.window_border_size = 0.0, 3.0, 0.0
    for name, grey in _GREYS:
        if hasattr(imgui.Col_, name):  # some need a newer version
            style.set_color_(int(getattr(imgui.Col_, name)), imgui.ImVec4(grey, grey, grey, 1.0))
