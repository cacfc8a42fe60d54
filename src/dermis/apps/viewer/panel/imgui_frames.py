"""Frames of Dear ImGui on a device, and what they do with code that fails in one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from imgui_bundle import imgui, implot
from wgpu.utils.imgui import ImguiWgpuBackend

from dermis.apps.viewer.panel.style import set_style
from dermis.gpu import Device

Tell = Callable[[Exception], None]


class ImguiFrames:
    """A context of Dear ImGui with the resources that draw it.

    tell : called with what failed; frames go on
    """

    def __init__(self, tell: Tell) -> None:
        self._tell = tell
        self._context: Any = None
        self._plots: Any = None
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

    def render(self, target: Any) -> None:
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
