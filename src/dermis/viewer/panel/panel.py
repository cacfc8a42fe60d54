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
    ("window_bg", 0.08, 1.0),
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
            from imgui_bundle import imgui, implot
        except ImportError:
            refuse("panel", "the package imgui-bundle", "it is not installed", _INSTALL)
        self._desk, self._imgui, self._implot = desk, imgui, implot
        self.visible = True
        self._is_new, self._has_popup = True, False
        self._context: Any = None
        self._backend: Any = None

    def open(self, device: Device, target: str) -> None:
        """Make what a device needs to draw into textures of a format."""
        from wgpu.utils.imgui import ImguiWgpuBackend

        # A context knows its font's texture, which another device's would not be.
        self._context = self._imgui.create_context()
        self._plots = self._implot.create_context()
        self._enter()
        _set_style(self._imgui)
        self._is_new = True
        self._device = device
        self._backend = ImguiWgpuBackend(device.handle, target)

    def width(self, size: tuple[float, float]) -> float:
        """Columns of a window of that size that it takes from the picture, logical."""
        return round(min(_WIDTH, _MOST_OF_WINDOW * size[0])) if self.visible else 0.0

    def feed(self, event: Mapping[str, Any], size: tuple[float, float]) -> bool:
        """Take an event in; returns whether it was meant for the panel and for nothing behind it."""
        from dermis.viewer.panel.input import feed

        self._enter()
        if event["event_type"] == "key_down" and event["key"] == "Tab" and not self._types:
            self.visible = not self.visible
            return True
        return feed(self._imgui.get_io(), event, lambda x, _: self._covers(x, size))

    @property
    def is_active(self) -> bool:
        """Whether something of it is held or typed into."""
        self._enter()
        return bool(self._imgui.is_any_item_active())

    def draw(self, target: Any, size: tuple[float, float], pixel_ratio: float) -> None:
        """Draw over what the target shows.

        size : of the window, logical
        """
        imgui = self._imgui
        from dermis.viewer.panel.over import draw_divider, draw_lines

        self._enter()
        io = imgui.get_io()
        io.display_size = imgui.ImVec2(*size)
        io.display_framebuffer_scale = imgui.ImVec2(pixel_ratio, pixel_ratio)
        for _ in range(2 if self._is_new else 1):  # a window's first frame only measures it
            self._is_new = False
            imgui.new_frame()
            try:
                if self.visible:
                    self._draw_sections(size)
                else:
                    self._has_popup = False
                draw_divider(self._desk.split, self.width(size), size)
                draw_lines(self._lines(), self.width(size), size)
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

    def _enter(self) -> None:
        self._imgui.set_current_context(self._context)
        self._implot.set_current_context(self._plots)

    def _lines(self) -> list[str]:
        messages = self._desk.messages
        hint = "" if self.visible else "Tab shows the panel"
        return [line for line in (messages.said, messages.status, hint) if line]

    def _covers(self, x: float, size: tuple[float, float]) -> bool:
        """Whether a pointer there is the panel's; Dear ImGui itself knows it only a frame later."""
        return x < self.width(size) or self._has_popup or self.is_active

    def _draw_sections(self, size: tuple[float, float]) -> None:
        from dermis.viewer.panel.fields import note_place
        from dermis.viewer.panel.sections import SECTIONS

        imgui = self._imgui
        width = self.width(size)
        imgui.set_next_window_pos(imgui.ImVec2(0.0, 0.0))
        imgui.set_next_window_size(imgui.ImVec2(width, size[1]))
        still = imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_collapse
        imgui.begin("dermis", None, int(still | imgui.WindowFlags_.no_title_bar))
        imgui.push_item_width(0.58 * width)
        for section in SECTIONS:
            flags = int(imgui.TreeNodeFlags_.default_open) if section.OPEN else 0
            is_open = imgui.collapsing_header(section.TITLE, flags)
            note_place(self._desk, section.TITLE)
            if is_open:
                section.draw(self._desk)
        imgui.pop_item_width()
        self._has_popup = bool(imgui.is_popup_open("", int(imgui.PopupFlags_.any_popup)))
        imgui.end()


def _set_style(imgui: Any) -> None:
    """A legible font on a dark ground."""
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
