"""The panel: a column of sections on the left, and a line of text under the picture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dermis.errors import refuse
from dermis.gpu import Device
from dermis.viewer.desk import Desk

_WIDTH, _FONT_SIZE = 290.0, 15.0
_MOST_OF_WINDOW = 0.5
_GREYS = (
    ("window_bg", 0.08, 0.86),
    ("frame_bg", 0.18, 1.0),
    ("frame_bg_hovered", 0.26, 1.0),
    ("frame_bg_active", 0.32, 1.0),
    ("slider_grab", 0.62, 1.0),
    ("slider_grab_active", 0.8, 1.0),
    ("check_mark", 0.8, 1.0),
    ("button", 0.26, 1.0),
    ("button_hovered", 0.36, 1.0),
    ("button_active", 0.46, 1.0),
    ("header", 0.22, 1.0),
    ("header_hovered", 0.32, 1.0),
    ("header_active", 0.4, 1.0),
    ("text_selected_bg", 0.4, 1.0),
    ("nav_cursor", 0.6, 1.0),
)
_INSTALL = 'Install it: pip install "dermis[viewer]"'


class Panel:
    """Draws the sections with Dear ImGui, and tells which events are theirs.

    Raises DermisError without the package imgui-bundle.
    """

    def __init__(self, desk: Desk) -> None:
        try:
            from imgui_bundle import imgui
        except ImportError:
            refuse("panel", "the package imgui-bundle", "it is not installed", _INSTALL)
        self._desk, self._imgui = desk, imgui
        self.visible = True
        self._covered = (0.0, 0.0)
        self._is_new, self._has_popup = True, False
        self._context: Any = None
        self._backend: Any = None

    def open(self, device: Device, target: str) -> None:
        """Make what a device needs to draw into textures of a format."""
        from wgpu.utils.imgui import ImguiWgpuBackend

        # A context knows its font's texture, which another device's would not be.
        self._context = self._imgui.create_context()
        self._imgui.set_current_context(self._context)
        _set_style(self._imgui)
        self._is_new = True
        self._device = device
        self._backend = ImguiWgpuBackend(device.handle, target)

    def feed(self, event: Mapping[str, Any]) -> bool:
        """Take an event in; returns whether it was meant for the panel and for nothing behind it."""
        from dermis.viewer.panel.input import feed

        self._imgui.set_current_context(self._context)
        if event["event_type"] == "key_down" and event["key"] == "Tab" and not self._types:
            self.visible = not self.visible
            return True
        return feed(self._imgui.get_io(), event, self._covers)

    @property
    def is_active(self) -> bool:
        """Whether something of it is held or typed into."""
        self._imgui.set_current_context(self._context)
        return bool(self._imgui.is_any_item_active())

    def draw(self, target: Any, size: tuple[float, float], pixel_ratio: float) -> None:
        """Draw over what the target shows.

        size : of the window, logical
        """
        imgui = self._imgui
        imgui.set_current_context(self._context)
        io = imgui.get_io()
        io.display_size = imgui.ImVec2(*size)
        io.display_framebuffer_scale = imgui.ImVec2(pixel_ratio, pixel_ratio)
        for _ in range(2 if self._is_new else 1):  # a window's first frame only measures it
            self._is_new = False
            imgui.new_frame()
            try:
                self._covered = self._draw_sections(size) if self.visible else (0.0, 0.0)
                self._draw_lines(size)
            finally:
                imgui.render()
        encoder = self._device.handle.create_command_encoder()
        kept = {"view": target, "load_op": "load", "store_op": "store"}
        one = encoder.begin_render_pass(label="panel", color_attachments=[kept])
        self._backend.render(imgui.get_draw_data(), one)
        one.end()
        self._device.handle.queue.submit([encoder.finish()])

    @property
    def _types(self) -> bool:
        return bool(self._imgui.get_io().want_text_input)

    def _covers(self, x: float, y: float) -> bool:
        """Whether a pointer there is the panel's; Dear ImGui itself knows it only a frame later."""
        inside = x < self._covered[0] and y < self._covered[1]
        return inside or self._has_popup or self.is_active

    def _draw_sections(self, size: tuple[float, float]) -> tuple[float, float]:
        """Returns the corner of the window that it covers."""
        from dermis.viewer.panel.sections import SECTIONS

        imgui = self._imgui
        width = min(_WIDTH, _MOST_OF_WINDOW * size[0])
        imgui.set_next_window_pos(imgui.ImVec2(0.0, 0.0))
        imgui.set_next_window_size_constraints(imgui.ImVec2(width, 0.0), imgui.ImVec2(width, size[1]))
        still = imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_collapse
        fitted = imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_title_bar
        imgui.begin("dermis", None, int(still | fitted))
        imgui.push_item_width(0.58 * width)
        for section in SECTIONS:
            flags = int(imgui.TreeNodeFlags_.default_open) if section.OPEN else 0
            if imgui.collapsing_header(section.TITLE, flags):
                section.draw(self._desk)
        imgui.pop_item_width()
        self._has_popup = bool(imgui.is_popup_open("", int(imgui.PopupFlags_.any_popup)))
        covered = imgui.get_window_size()
        imgui.end()
        return float(covered.x), float(covered.y)

    def _draw_lines(self, size: tuple[float, float]) -> None:
        """What the adapter is and what was said last, at the lower edge."""
        imgui, messages = self._imgui, self._desk.messages
        lines = [line for line in (messages.said, messages.status) if line]
        if not lines:
            return
        over = imgui.get_foreground_draw_list()
        left = self._covered[0] + 10.0
        wrapped = max(80.0, size[0] - left - 10.0)
        text = "\n".join(lines)
        box = imgui.calc_text_size(text, False, wrapped)
        top = size[1] - box.y - 10.0
        shade, white = imgui.IM_COL32(0, 0, 0, 150), imgui.IM_COL32(235, 235, 235, 255)
        corners = imgui.ImVec2(left - 6, top - 4), imgui.ImVec2(left + box.x + 6, size[1] - 6)
        over.add_rect_filled(*corners, shade, 4.0)
        font, place = imgui.get_font(), imgui.ImVec2(left, top)
        over.add_text(font, imgui.get_font_size(), place, white, text, wrapped)


def _set_style(imgui: Any) -> None:
    """A legible font on a dark, slightly clear ground."""
    from pathlib import Path

    import imgui_bundle

    io, style = imgui.get_io(), imgui.get_style()
    font = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
    if font.is_file():
        io.fonts.add_font_from_file_ttf(str(font), _FONT_SIZE)
    imgui.style_colors_dark()
    style.window_rounding, style.frame_rounding, style.window_border_size = 0.0, 3.0, 0.0
    for name, grey, alpha in _GREYS:  # colours beside skin would change how it is judged
        style.set_color_(int(getattr(imgui.Col_, name)), imgui.ImVec4(grey, grey, grey, alpha))
