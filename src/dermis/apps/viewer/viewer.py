"""Viewer of a head on a canvas, which may be in a desktop window, a browser or a notebook."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dermis.apps.viewer.controls import Event, picture_event
from dermis.apps.viewer.navigation import CameraEasing
from dermis.apps.viewer.player import MotionFile
from dermis.apps.viewer.session import Session
from dermis.apps.viewer.state import ViewerState
from dermis.apps.viewer.view_renderer import HeadPreparation, LiveAndFrozenImages, ViewRenderer
from dermis.base.errors import DermisError
from dermis.gpu import Device, Texture, TextureView
from dermis.gpu.failures import DeviceLostError, converted_gpu_failures
from dermis.gpu.program import Program
from dermis.scene.camera import Camera

Canvas = Any
"""Canvas of any backend of rendercanvas, which has no type annotations."""
PixelBox = tuple[int, int, int, int]
"""Left, top, width and height [pixel]."""


class PlacedImage(NamedTuple):
    """Image that is scaled to a viewport of the target and clipped to a scissor rectangle.

    image : texture of sRGB bytes
    viewport : left, top, width and height of the viewport [pixel]
    scissor : left, top, width and height of the scissor rectangle [pixel]
    """

    image: Texture
    viewport: PixelBox
    scissor: PixelBox


class BlitProgram(Program):
    """Program that draws images of sRGB bytes into targets of one texture format."""

    stages = "VERTEX", "FRAGMENT"

    def __init__(self, device: Device, target_format: str) -> None:
        super().__init__(device, Path(__file__).parent / "blit.wgsl")
        fragment = {
            "module": self._module,
            "entry_point": "fragment",
            "constants": {"DECODED": target_format.endswith("-srgb")},
            "targets": [{"format": target_format}],
        }
        self._pipeline = device.handle.create_render_pipeline(
            layout=self._layout,
            vertex={"module": self._module, "entry_point": "vertex"},
            fragment=fragment,
            primitive={"topology": "triangle-list", "cull_mode": "none"},
        )

    def draw(self, placed_images: Sequence[PlacedImage], target_view: TextureView) -> None:
        """Draw images over a black background.

        target_view : view of the target texture
        """
        encoder = self.device.handle.create_command_encoder()
        attachment = {
            "view": target_view,
            "load_op": "clear",
            "store_op": "store",
            "clear_value": (0, 0, 0, 1),
        }
        render_pass = encoder.begin_render_pass(label="blit", color_attachments=[attachment])
        render_pass.set_pipeline(self._pipeline)
        for placed_image in placed_images:
            render_pass.set_viewport(*placed_image.viewport, 0.0, 1.0)
            render_pass.set_scissor_rect(*placed_image.scissor)
            entry = {"binding": 0, "resource": placed_image.image.create_view()}
            group = self.device.handle.create_bind_group(layout=self._group_layout, entries=[entry])
            render_pass.set_bind_group(0, group)
            render_pass.draw(3)
        render_pass.end()
        self.device.handle.queue.submit([encoder.finish()])


_STILL_FRAME_DELAY_S = 0.25  # time since the last change after which the picture is refined
_MAX_EASING_STEP_S = 0.2  # largest time step of the camera easing in a frame
_MAX_DEVICE_FAILURES = 1  # consecutive failures of the device
_PANEL_SETTLING_FRAMES = 3  # frames that the panel needs to settle after an event
_POINTER_EVENTS = "pointer_down", "pointer_move", "pointer_up", "pointer_leave", "double_click", "wheel"
_KEY_EVENTS = "key_down", "key_up", "char"


class Viewer:
    """Interactive view of a head on a canvas.

    state : initial state
    canvas : canvas of any backend of rendercanvas
    adapter : "auto", "cpu" or part of an adapter's name
    clock : function that returns the time [s]
    motion : motion to play; None if there is no motion
    view_renderer : renderer that has already prepared the state; None to create a renderer

    failure : error that closed the canvas, because the device failed twice or could not be reopened; None if
        there was no such error

    Raises DermisError if there is no adapter, and ImportError if the extra `viewer` is not installed.
    """

    def __init__(
        self,
        state: ViewerState,
        canvas: Canvas,
        adapter: str = "auto",
        clock: Callable[[], float] = time.perf_counter,
        motion: MotionFile | None = None,
        view_renderer: ViewRenderer | None = None,
    ) -> None:
        from dermis.apps.viewer.panel.panel import Panel  # needs packages of the extra `viewer`

        self.canvas = canvas
        self._adapter, self._clock = adapter, clock
        self._context = canvas.get_wgpu_context()
        self.session = Session(state, view_renderer or ViewRenderer(adapter), motion, clock)
        self._preparation = HeadPreparation(self._connect_page())
        self.session.player.play()
        self.panel = Panel(self.session)
        self._easing = CameraEasing(state.scene.camera)
        self._last_draw = self._last_change = clock()
        self._last_state = state
        self._last_size = (0, 0)
        self._rejected_state: ViewerState | None = None
        self._failures = self._panel_frames = 0
        self.failure: DermisError | None = None
        self._is_drag_on_panel, self._left_at_press = False, 0.0
        self._configure_canvas()
        canvas.add_event_handler(self._on_event, *_POINTER_EVENTS, *_KEY_EVENTS)
        canvas.request_draw(self.draw)

    def draw(self) -> None:
        """Draw a frame into the canvas; reopen the device if it was lost."""
        try:
            with converted_gpu_failures(self.session.view_renderer.renderer.device):
                self._draw(self._clock())
            self._failures = 0
        except DermisError as error:
            self._reopen_device(error)
        except Exception as error:
            self.session.report_error("This frame cannot be drawn", error)
            return  # the next event draws another frame
        needs_frame = not self.is_still and not self._preparation.is_running  # its end requests a frame
        if needs_frame or self._panel_frames:
            self._panel_frames = max(0, self._panel_frames - 1)
            self.canvas.request_draw()

    @property
    def is_still(self) -> bool:
        """Return whether the picture on screen is final, so no frame is needed until something changes."""
        state, view_renderer = self.session.displayed_state, self.session.view_renderer
        is_settled = self._last_state is state and self._easing.camera == state.scene.camera
        is_final = view_renderer.has_full_quality or self._rejected_state is state
        is_ready = not self._preparation.is_running
        return is_ready and is_settled and is_final and not self._is_moving(self._clock())

    def _draw(self, now_s: float) -> None:
        session, size = self.session, self._picture_size()
        session.show_loaded_head()
        session.player.advance()
        session.heartbeat.advance()
        state, elapsed = session.displayed_state, min(now_s - self._last_draw, _MAX_EASING_STEP_S)
        old_camera = self._easing.camera
        camera = self._easing.advance(state.scene.camera, elapsed)
        if state is not self._last_state or camera != old_camera or size != self._last_size:
            self._last_change, self._last_state, self._last_size = now_s, state, size
        self._last_draw, session.view_size = now_s, size
        images = self._render_images(state, camera, size, self._is_moving(now_s))
        session.status = self._status_text(size)
        target = self._context.get_current_texture().create_view()
        self._blit.draw(self._placed_images(*images, size), target)
        self.panel.draw(target, self.canvas.get_logical_size(), self.canvas.get_pixel_ratio())

    def _panel_width(self) -> int:
        """Return the width that the panel takes away from the picture [pixel]."""
        width = self.panel.width(self.canvas.get_logical_size())
        return round(float(self.canvas.get_pixel_ratio()) * width)

    def _picture_size(self) -> tuple[int, int]:
        """Return the width and height of the picture: the part of the window beside the panel [pixel]."""
        width, height = self.canvas.get_physical_size()
        return max(1, width - self._panel_width()), max(1, height)

    def _placed_images(
        self, live_image: Texture, frozen_image: Texture | None, picture_size: tuple[int, int]
    ) -> list[PlacedImage]:
        """Return the live image and, if there is one, the frozen image, each with its place in the target.

        A frozen image is placed left of the divider, and the live image right of it.

        picture_size : width and height of the picture [pixel]
        """
        left, (width, height) = self._panel_width(), picture_size
        viewport = left, 0, width, height
        if frozen_image is None:
            return [PlacedImage(live_image, viewport, viewport)]
        divider = round(self.session.split.divider_position * width)
        placed_images = (
            PlacedImage(frozen_image, viewport, (left, 0, divider, height)),
            PlacedImage(live_image, viewport, (left + divider, 0, width - divider, height)),
        )
        return [placed_image for placed_image in placed_images if placed_image.scissor[2]]

    def _render_images(
        self, state: ViewerState, camera: Camera, picture_size: tuple[int, int], is_moving: bool
    ) -> LiveAndFrozenImages:
        """Return the live and the frozen image; if `state` cannot be rendered, the last image and None."""
        import wgpu

        session = self.session
        if state is not self._rejected_state:
            try:
                if held_image := self._preparation.prepare_head(session.view_renderer, state):
                    return held_image, None
                frozen_state = session.split.frozen_state
                images = session.view_renderer.render_images(
                    state, frozen_state, camera, picture_size, is_moving
                )
                if self._rejected_state:
                    self._rejected_state, session.message = None, ""
                return images
            except DermisError as error:
                if session.view_renderer.last_image is None or isinstance(error, DeviceLostError):
                    raise
                self._reject_state(state, str(error))
            except wgpu.GPUError:
                raise  # converted to an error of the device by `draw`
            except Exception as error:
                if session.view_renderer.last_image is None:
                    raise
                self._reject_state(state)
                session.report_error("This cannot be drawn", error)
        assert session.view_renderer.last_image is not None  # otherwise an exception was raised
        return session.view_renderer.last_image, None

    def _reject_state(self, state: ViewerState, message: str = "") -> None:
        self._rejected_state = state
        self.session.message = message

    def _is_moving(self, now_s: float) -> bool:
        return self.session.is_playing or now_s - self._last_change < _STILL_FRAME_DELAY_S

    def _status_text(self, picture_size: tuple[int, int]) -> str:
        view_renderer = self.session.view_renderer
        settings = view_renderer.settings
        if self._preparation.is_running:
            return "preparing the head ..."
        is_software = view_renderer.quality_controller.software
        if settings is None or view_renderer.rendered is None or not is_software:
            return ""
        width, height = settings.size
        text = f"software adapter, no GPU: {width} x {height}"
        if view_renderer.has_full_quality and settings.size == picture_size:
            return text
        return f"{text}, atlas {settings.atlas} while moving, refined when still"

    def _on_event(self, event: Event) -> None:
        kind = event["event_type"]
        self._panel_frames = _PANEL_SETTLING_FRAMES
        is_for_panel = self.panel.handle_event(event, self.canvas.get_logical_size())
        if kind == "pointer_down":
            self._is_drag_on_panel = is_for_panel
        if not (self._is_drag_on_panel if kind in ("pointer_move", "pointer_up") else is_for_panel):
            self._on_picture_event(event)
        if kind == "pointer_up":
            self._is_drag_on_panel = False
        self.canvas.request_draw()

    def _on_picture_event(self, event: Event) -> None:
        """Handle an event over the picture.

        During a drag, positions are relative to the picture's left edge at the start of the drag, even if the
        edge moves.
        """
        width, height = self.canvas.get_logical_size()
        left = self.panel.width((width, height))
        if event["event_type"] == "pointer_down":
            self._left_at_press = left
        start = self._left_at_press if event["event_type"] in ("pointer_move", "pointer_up") else left
        shifted, size = picture_event(event, start), (max(1.0, width - left), height)
        if not self.session.split.handle(shifted, size[0]):
            self.session.controls.handle(shifted, size)

    def _configure_canvas(self) -> None:
        """Configure the canvas and the panel for the device that the renderer uses."""
        device = self.session.view_renderer.renderer.device
        format_ = str(self._context.get_preferred_format(device.adapter.handle)).removesuffix("-srgb")
        self._context.configure(device=device.handle, format=format_)
        self._blit = BlitProgram(device, format_)
        self.panel.open(device, format_)

    def _connect_page(self) -> Callable[[], None]:
        """Connect the session to a web page's uploads and downloads; return a function to request a frame."""
        canvas, session = self.canvas, self.session
        session.offer_download = getattr(canvas, "offer_download", None)
        session.request_file = getattr(canvas, "request_file", None)
        if session.request_file:
            canvas.on_file = lambda path, name: session.heads.open(str(path), name)
        loop = canvas._rc_canvas_group.get_loop()
        session.heads.request_frame = lambda: loop and loop.call_soon_threadsafe(canvas.request_draw)
        return session.heads.request_frame

    def _reopen_device(self, error: DermisError) -> None:
        """Reopen the device after it was lost or ran out of memory."""
        import wgpu

        self._failures += 1
        with contextlib.suppress(wgpu.GPUError):  # release the texture of the old device
            self._context.unconfigure()
        try:
            if self._failures > _MAX_DEVICE_FAILURES:
                raise error.lost_twice_error() if isinstance(error, DeviceLostError) else error
            self.session.view_renderer = ViewRenderer(self._adapter)
            self._preparation.reset()
            self._configure_canvas()
        except DermisError as final_error:
            self.failure = final_error
            self.canvas.close()
            return
        self.session.message = "the graphics device was lost and has been reopened"
        self.canvas.request_draw()
