"""Dear ImGui on a wgpu device: style, frames, input, and recovery from errors while a frame is laid out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui, implot
from wgpu.utils.imgui import ImguiRenderer, ImguiWgpuBackend

from dermis.apps.viewer.controls import Event
from dermis.gpu import Device, TextureView

_FONT_SIZE = 15.0
_GREY_LEVEL_BY_STYLE_COLOUR = (  # no hues, because they would affect the perception of the skin beside them
    ("window_bg", 0.08),
    ("frame_bg", 0.18),
    ("frame_bg_hovered", 0.26),
    ("frame_bg_active", 0.32),
    ("slider_grab", 0.42),  # dark enough to read the number on it
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
    """Set a legible font and a dark colour scheme."""
    io, style = imgui.get_io(), imgui.get_style()
    font = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
    if font.is_file():
        io.fonts.add_font_from_file_ttf(str(font), _FONT_SIZE)
    imgui.style_colors_dark()
    io.fonts.flags |= int(imgui.ImFontAtlasFlags_.no_baked_lines)  # some backends cannot draw them
    style.window_rounding, style.frame_rounding, style.window_border_size = 0.0, 3.0, 0.0
    for name, grey in _GREY_LEVEL_BY_STYLE_COLOUR:
        if hasattr(imgui.Col_, name):  # some names require a newer version
            style.set_color_(int(getattr(imgui.Col_, name)), imgui.ImVec4(grey, grey, grey, 1.0))


ReportError = Callable[[Exception], None]


class ImguiFrames:
    """Dear ImGui context, with the GPU resources that draw its frames.

    report_error : function called with each error that is raised while a frame is laid out; later frames are
        still drawn
    """

    def __init__(self, report_error: ReportError) -> None:
        self._report_error = report_error
        self._is_new = self._has_layout = False

    def open(self, device: Device, target_format: str) -> None:
        """Create the Dear ImGui context, and the GPU resources that draw its frames.

        target_format : format of the textures to draw into
        """
        # A context holds its font texture, which belongs to one device.
        self._context = imgui.create_context()
        self._plot_context = implot.create_context()
        self.make_context_current()
        set_style()
        self._is_new = True
        self._device, self._target = device, target_format
        self._imgui_backend = ImguiWgpuBackend(device.handle, target_format)

    def make_context_current(self) -> None:
        """Make the context of this object the current context of Dear ImGui."""
        imgui.set_current_context(self._context)
        implot.set_current_context(self._plot_context)

    def lay_out(self, window_size: tuple[float, float], declare_controls: Callable[[], None]) -> None:
        """Process pending input and lay out the next frame; `render` draws this frame.

        window_size : logical size of the window
        declare_controls : function that declares the windows and controls
        """
        try:
            imgui.get_io().display_size = imgui.ImVec2(*window_size)
            for _ in range(2 if self._is_new else 1):  # the first frame of a context only measures the window
                self._is_new = False
                imgui.new_frame()
                with recover_imgui(self._report_error):
                    declare_controls()
                imgui.render()
            self._has_layout = True
        except Exception as error:  # raised by Dear ImGui itself, whose context is then unusable
            self._report_error(error)
            self._recreate_context()

    def render(self, target_view: TextureView) -> None:
        """Draw the last frame over the content of the target; draw nothing if laying it out failed."""
        if not self._has_layout:
            return
        encoder = self._device.handle.create_command_encoder()
        attachment = {"view": target_view, "load_op": "load", "store_op": "store"}
        render_pass = encoder.begin_render_pass(label="panel", color_attachments=[attachment])
        self._imgui_backend.render(imgui.get_draw_data(), render_pass)
        render_pass.end()
        self._device.handle.queue.submit([encoder.finish()])

    def _recreate_context(self) -> None:
        """Replace the context after an error in Dear ImGui; this resets which panel sections are open."""
        self._has_layout = False
        implot.destroy_context(self._plot_context)
        imgui.destroy_context(self._context)
        self.open(self._device, self._target)


@contextmanager
def recover_imgui(report_error: ReportError) -> Iterator[None]:
    """Catch an exception of the with block; close the windows, tables, styles and ids that it left open.

    report_error : function called with the exception
    """
    state = imgui.internal.ErrorRecoveryState()
    imgui.internal.error_recovery_store_state(state)
    try:
        yield
    except Exception as error:
        io = imgui.get_io()
        io.config_error_recovery_enable_assert = False  # otherwise each missing end would raise an error
        io.config_error_recovery_enable_debug_log = io.config_error_recovery_enable_tooltip = False
        imgui.internal.error_recovery_try_to_recover_state(state)
        io.config_error_recovery_enable_assert = True
        report_error(error)


POINTER_EVENTS = ("pointer_down", "pointer_move", "pointer_up", "double_click", "wheel")
_SCROLL_PER_WHEEL_UNIT = 0.01


def feed_pointer(event: Event, lay_out_frame: Callable[[], None]) -> None:
    """Pass a pointer event, one of the types in `POINTER_EVENTS`, to Dear ImGui.

    The panel is laid out before and after each press and release, so that Dear ImGui processes them apart
    from movements of the pointer.

    lay_out_frame : function that lays out the panel, using all events received so far
    """
    kind = event["event_type"]
    imgui.get_io().add_mouse_pos_event(event["x"], event["y"])
    if kind in ("pointer_down", "pointer_up"):
        # A slider ignores a move in the frame of its release, and a press uses the last move of its frame.
        lay_out_frame()  # may replace the context and its inputs
        imgui.get_io().add_mouse_button_event(max(0, event["button"] - 1), kind == "pointer_down")
        lay_out_frame()
    elif kind == "wheel":
        imgui.get_io().add_mouse_wheel_event(
            -_SCROLL_PER_WHEEL_UNIT * event["dx"], -_SCROLL_PER_WHEEL_UNIT * event["dy"]
        )


def feed_key(event: Event, lay_out_frame: Callable[[], None]) -> None:
    """Pass a key or character event to Dear ImGui, and lay out the panel immediately.

    Otherwise, a key that is pressed and released between two frames would have no effect.

    lay_out_frame : function that lays out the panel, using all events received so far
    """
    io, kind = imgui.get_io(), event["event_type"]
    if kind == "char":
        io.add_input_characters_utf8(event.get("data") or event.get("char_str") or "")
    else:
        _change_key(io, str(event["key"]), kind == "key_down")
    lay_out_frame()


def _change_key(imgui_io: imgui.IO, key_name: str, is_down: bool) -> None:
    key = ImguiRenderer.KEY_MAP.get(key_name)
    if key is None and len(key_name) == 1 and key_name.isascii() and key_name.isalnum():
        key = getattr(imgui.Key, f"_{key_name}" if key_name.isdigit() else key_name.lower(), None)
    if key is not None:
        imgui_io.add_key_event(key, is_down)
    if key_name in ImguiRenderer.KEY_MAP_MOD:
        imgui_io.add_key_event(ImguiRenderer.KEY_MAP_MOD[key_name], is_down)
