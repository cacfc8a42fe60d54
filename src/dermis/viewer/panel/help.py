"""What hands and keys do, over the picture."""

from __future__ import annotations

from imgui_bundle import imgui

KEYS = ("?", "h", "H", "F1")
"""That show it and take it away."""

HANDS = (
    ("drag", "turn the head"),
    ("right drag, two fingers", "pan"),
    ("wheel, pinch", "come nearer"),
    ("double click", "turn around that place"),
    ("Shift and drag", "carry the chosen light, or turn the environment"),
    ("1 2 3 4 5", "portrait, three-quarter, profile, ear, cheek"),
    ("Ctrl+Z, Ctrl+Y", "undo, redo"),
    ("Ctrl and click", "type a slider's number"),
    ("Ctrl+S", "save the scene"),
    ("Tab", "hide the panel, show it again"),
    ("? or H", "these lines"),
)
_WIDEST, _MARGIN, _FIRST = 460.0, 12.0, 0.4


def draw_help(left: float, size: tuple[float, float]) -> None:
    """A table in the middle of the picture, which begins at `left`; it lets every pointer through.

    size : of the window, logical
    """
    width = min(_WIDEST, size[0] - left - 2.0 * _MARGIN)
    imgui.set_next_window_pos(imgui.ImVec2(0.5 * (left + size[0]), 0.5 * size[1]), 0, imgui.ImVec2(0.5, 0.5))
    imgui.set_next_window_size(imgui.ImVec2(width, 0.0))
    imgui.set_next_window_bg_alpha(0.88)
    flags = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_inputs | imgui.WindowFlags_.no_nav
    imgui.begin("hands and keys", None, int(flags))
    if imgui.begin_table("hands", 2, int(imgui.TableFlags_.sizing_stretch_prop)):
        imgui.table_setup_column("hand", int(imgui.TableColumnFlags_.width_stretch), _FIRST)
        imgui.table_setup_column("what", int(imgui.TableColumnFlags_.width_stretch), 1.0 - _FIRST)
        for hand, what in HANDS:
            imgui.table_next_column()
            imgui.text_wrapped(hand)
            imgui.table_next_column()
            imgui.text_wrapped(what)
        imgui.end_table()
    imgui.end()
