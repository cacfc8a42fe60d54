"""Dear ImGui on a device: its style, its frames, its input, and recovery from code that fails in a frame."""

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


Tell = Callable[[Exception], None]


class ImguiFrames:
    """A context of Dear ImGui with the resources that draw it.

    tell : called with what failed; frames go on
    """

    def __init__(self, tell: Tell) -> None:
        self._tell = tell
        self._is_new = self._is_whole = False

    def open(self, device: Device, target: str) -> None:
        """Create the resources for drawing into textures of a format."""
        # A context holds its font's texture, which belongs to one device.
        self._context = imgui.create_context()
        self._plots = implot.create_context()
        self.enter()
        set_style()
        self._is_new = True
        self._device, self._target = device, target
        self._backend = ImguiWgpuBackend(device.handle, target)

    def enter(self) -> None:
        """Make it the context that calls of Dear ImGui act on."""
        imgui.set_current_context(self._context)
        implot.set_current_context(self._plots)

    def lay_out(self, size: tuple[float, float], draw: Callable[[], None]) -> None:
        """Let Dear ImGui see the events so far, and lay out what `render` draws.

        size : of the window, logical
        """
        try:
            imgui.get_io().display_size = imgui.ImVec2(*size)
            for _ in range(2 if self._is_new else 1):  # the first frame of a window only measures it
                self._is_new = False
                imgui.new_frame()
                with closed_again(self._tell):
                    draw()
                imgui.render()
            self._is_whole = True
        except Exception as error:  # of Dear ImGui itself, which cannot go on from there
            self._tell(error)
            self._begin_anew()

    def render(self, target: TextureView) -> None:
        """Draw over what the target shows; nothing where the last layout failed."""
        if not self._is_whole:
            return
        encoder = self._device.handle.create_command_encoder()
        attachment = {"view": target, "load_op": "load", "store_op": "store"}
        render_pass = encoder.begin_render_pass(label="panel", color_attachments=[attachment])
        self._backend.render(imgui.get_draw_data(), render_pass)
        render_pass.end()
        self._device.handle.queue.submit([encoder.finish()])

    def _begin_anew(self) -> None:
        """Take another context, which forgets which sections are open."""
        self._is_whole = False
        implot.destroy_context(self._plots)
        imgui.destroy_context(self._context)
        self.open(self._device, self._target)


@contextmanager
def closed_again(tell: Tell) -> Iterator[None]:
    """End what an error inside left open: windows, tables, pushed styles and ids."""
    before = imgui.internal.ErrorRecoveryState()
    imgui.internal.error_recovery_store_state(before)
    try:
        yield
    except Exception as error:
        io = imgui.get_io()
        io.config_error_recovery_enable_assert = False  # each end that is missing would be an error again
        io.config_error_recovery_enable_debug_log = io.config_error_recovery_enable_tooltip = False
        imgui.internal.error_recovery_try_to_recover_state(before)
        io.config_error_recovery_enable_assert = True
        tell(error)


POINTER = ("pointer_down", "pointer_move", "pointer_up", "double_click", "wheel")
_WHEEL = 0.01


def feed_pointer(event: Event, frame: Callable[[], None]) -> None:
    """Process an event of `POINTER`.

    frame : lays out the panel with the events so far
    """
    kind = event["event_type"]
    imgui.get_io().add_mouse_pos_event(event["x"], event["y"])
    if kind in ("pointer_down", "pointer_up"):
        # A slider ignores a move in the frame of its release, and a press is where that frame's last move is.
        frame()  # which may take another context, with other inputs
        imgui.get_io().add_mouse_button_event(max(0, event["button"] - 1), kind == "pointer_down")
        frame()
    elif kind == "wheel":
        imgui.get_io().add_mouse_wheel_event(-_WHEEL * event["dx"], -_WHEEL * event["dy"])


def feed_key(event: Event, frame: Callable[[], None]) -> None:
    """Process a key or a letter; it is seen in a frame of its own, as keys between two frames cancel out.

    frame : as above
    """
    io, kind = imgui.get_io(), event["event_type"]
    if kind == "char":
        io.add_input_characters_utf8(event.get("data") or event.get("char_str") or "")
    else:
        _change_key(io, str(event["key"]), kind == "key_down")
    frame()


def _change_key(io: imgui.IO, name: str, down: bool) -> None:
    key = ImguiRenderer.KEY_MAP.get(name)
    if key is None and len(name) == 1 and name.isascii() and name.isalnum():
        key = getattr(imgui.Key, f"_{name}" if name.isdigit() else name.lower(), None)
    if key is not None:
        io.add_key_event(key, down)
    if name in ImguiRenderer.KEY_MAP_MOD:
        io.add_key_event(ImguiRenderer.KEY_MAP_MOD[name], down)
