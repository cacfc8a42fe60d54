"""The panel: a column of sections on the left, and a line of text under the picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dermis.errors import refuse
from dermis.gpu import Device
from dermis.viewer.desk import Desk

_WIDTH, _FONT_SIZE = 290.0, 15.0
_MOST_OF_WINDOW, _LEAST_SCALE = 0.5, 0.8  # of text in a narrow panel
_GREYS = (
    ("window_bg", 0.08, 1.0),
    ("frame_bg", 0.18, 1.0),
    ("frame_bg_hovered", 0.26, 1.0),
    ("frame_bg_active", 0.32, 1.0),
    ("slider_grab", 0.42, 1.0),  # dark enough for the number over it
    ("slider_grab_active", 0.55, 1.0),
    ("check_mark", 0.8, 1.0),
    ("checkbox_selected_bg", 0.26, 1.0),
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
        self.visible, self.helps = True, False
        self._is_new, self._has_popup = True, False
        self._handle = (0.0, 0.0)
        self._scrolls = False
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
        if event["event_type"] == "key_down" and not self._types and self._obeys(event):
            return True
        if event["event_type"] == "pointer_down" and event["x"] >= self.width(size):
            self.helps = False
        return feed(self._imgui.get_io(), event, lambda x, y: self._covers(x, y, size))

    def _obeys(self, event: Mapping[str, Any]) -> bool:
        """Whether a key is about the panel itself."""
        from dermis.viewer.panel.fields import attempt
        from dermis.viewer.panel.help import KEYS

        key, desk = str(event["key"]), self._desk
        if {"Control", "Meta"} & set(event.get("modifiers", ())):
            if key.lower() != "s":
                return False
            attempt(desk, lambda: desk.save(Path(desk.names.scene)))
        elif key == "Tab":
            self.visible = not self.visible
        elif key in KEYS or (key == "Escape" and self.helps):
            self.helps = not self.helps
        else:
            return False
        return True

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
                self._draw_windows(size)
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
        return [line for line in (messages.said, messages.status) if line]

    def _covers(self, x: float, y: float, size: tuple[float, float]) -> bool:
        """Whether a pointer there is the panel's; Dear ImGui itself knows it only a frame later."""
        on_handle = not self.visible and x < self._handle[0] and y < self._handle[1]
        return x < self.width(size) or on_handle or self._has_popup or self.is_active

    def _draw_windows(self, size: tuple[float, float]) -> None:
        """The panel or what brings it back, and help."""
        from dermis.viewer.panel.help import draw_help
        from dermis.viewer.panel.toolbar import draw_handle

        if self.visible:
            self._draw_sections(size)
        else:
            self._has_popup = False
            self.visible, self._handle = draw_handle(self._desk)
        if self.helps:
            draw_help(self.width(size), size)

    def _draw_sections(self, size: tuple[float, float]) -> None:
        from dermis.viewer.panel.fields import note_place
        from dermis.viewer.panel.sections import SECTIONS
        from dermis.viewer.panel.toolbar import draw_toolbar

        imgui = self._imgui
        width = self.width(size)
        imgui.get_style().font_scale_main = max(_LEAST_SCALE, min(1.0, width / _WIDTH))
        imgui.set_next_window_pos(imgui.ImVec2(0.0, 0.0))
        imgui.set_next_window_size(imgui.ImVec2(width, size[1]))
        still = imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_collapse
        imgui.begin("dermis", None, int(still | imgui.WindowFlags_.no_title_bar))
        pressed = draw_toolbar(self._desk)
        self.helps, self.visible = self.helps ^ (pressed == "help"), pressed != "hide"
        imgui.push_item_width(0.58 * width)
        for section in SECTIONS:
            flags = int(imgui.TreeNodeFlags_.default_open) if section.OPEN else 0
            is_open = imgui.collapsing_header(section.TITLE, flags)
            note_place(self._desk, section.TITLE)
            if is_open:
                imgui.push_id(section.TITLE)  # several sections may use a label
                section.draw(self._desk)
                imgui.pop_id()
        imgui.pop_item_width()
        self._follow_finger()
        self._has_popup = bool(imgui.is_popup_open("", int(imgui.PopupFlags_.any_popup)))
        imgui.end()

    def _follow_finger(self) -> None:
        """Scroll along with a drag that began beside all controls, for fingers have no wheel."""
        imgui = self._imgui
        if imgui.is_mouse_clicked(0):
            self._scrolls = imgui.is_window_hovered() and not imgui.is_any_item_hovered()
        if self._scrolls and imgui.is_mouse_down(0):
            imgui.set_scroll_y(imgui.get_scroll_y() - imgui.get_io().mouse_delta.y)


def _set_style(imgui: Any) -> None:
    """A legible font on a dark ground."""
    import imgui_bundle

    io, style = imgui.get_io(), imgui.get_style()
    font = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
    if font.is_file():
        io.fonts.add_font_from_file_ttf(str(font), _FONT_SIZE)
    imgui.style_colors_dark()
    io.fonts.flags |= int(imgui.ImFontAtlasFlags_.no_baked_lines)  # which the backend may leave out
    style.window_rounding, style.frame_rounding, style.window_border_size = 0.0, 3.0, 0.0
    for name, grey, alpha in _GREYS:  # colours beside skin would change how it is judged
        if hasattr(imgui.Col_, name):  # some are new
            style.set_color_(int(getattr(imgui.Col_, name)), imgui.ImVec4(grey, grey, grey, alpha))
