"""The viewer on a canvas: the same in a desktop window, a browser and a notebook."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dermis.apps.viewer.controls import Event, shifted
from dermis.apps.viewer.navigation import Easing
from dermis.apps.viewer.player import MotionFile
from dermis.apps.viewer.session import Session
from dermis.apps.viewer.state import ViewerState
from dermis.apps.viewer.studio import Images, Preparation, Studio
from dermis.base.errors import DermisError
from dermis.gpu import Device, Texture, TextureView
from dermis.gpu.failures import DeviceLostError, gpu_failures
from dermis.gpu.program import Program
from dermis.scene.camera import Camera

Canvas = Any
"""A canvas of any backend of rendercanvas, which has no types for mypy."""
Box = tuple[int, int, int, int]
"""Left, top, width and height [pixel]."""


class Patch(NamedTuple):
    """An image scaled to a box of the target, and the part of that box that is drawn.

    image : texture of sRGB bytes
    """

    image: Texture
    box: Box
    shown: Box


class Blit(Program):
    """Draws byte images into targets of one format."""

    stages = "VERTEX", "FRAGMENT"

    def __init__(self, device: Device, target: str) -> None:
        super().__init__(device, Path(__file__).parent / "blit.wgsl")
        fragment = {
            "module": self._module,
            "entry_point": "fragment",
            "constants": {"DECODED": target.endswith("-srgb")},
            "targets": [{"format": target}],
        }
        self._pipeline = device.handle.create_render_pipeline(
            layout=self._layout,
            vertex={"module": self._module, "entry_point": "vertex"},
            fragment=fragment,
            primitive={"topology": "triangle-list", "cull_mode": "none"},
        )

    def draw(self, patches: Sequence[Patch], view: TextureView) -> None:
        """Draw patches on black.

        view : of the target texture
        """
        encoder = self.device.handle.create_command_encoder()
        target = {"view": view, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 1)}
        render_pass = encoder.begin_render_pass(label="blit", color_attachments=[target])
        render_pass.set_pipeline(self._pipeline)
        for patch in patches:
            render_pass.set_viewport(*patch.box, 0.0, 1.0)
            render_pass.set_scissor_rect(*patch.shown)
            entry = {"binding": 0, "resource": patch.image.create_view()}
            group = self.device.handle.create_bind_group(layout=self._group_layout, entries=[entry])
            render_pass.set_bind_group(0, group)
            render_pass.draw(3)
        render_pass.end()
        self.device.handle.queue.submit([encoder.finish()])


_QUIET_S = 0.25  # without a change, after which the picture is refined
_LONGEST_STEP_S = 0.2
_MOST_FAILURES = 1  # in a row
_PANEL_FRAMES = 3  # that the panel needs to settle after an event
_POINTER = "pointer_down", "pointer_move", "pointer_up", "pointer_leave", "double_click", "wheel"
_KEYS = "key_down", "key_up", "char"


class Viewer:
    """An interactive view of a head.

    state : what is shown first
    canvas : of any backend of rendercanvas
    adapter : "auto", "cpu" or part of an adapter's name
    clock : time [s]
    motion : played from the beginning
    studio : one on the adapter that has prepared the state already

    `failure` is the error that closed the canvas when the device failed twice or could not be opened again.

    Raises DermisError without an adapter, ImportError without the extra `viewer`.
    """

    def __init__(
        self,
        state: ViewerState,
        canvas: Canvas,
        adapter: str = "auto",
        clock: Callable[[], float] = time.perf_counter,
        motion: MotionFile | None = None,
        studio: Studio | None = None,
    ) -> None:
        from dermis.apps.viewer.panel.panel import Panel  # whose packages are in the extra `viewer`

        self.canvas = canvas
        self._adapter, self._clock = adapter, clock
        self._context = canvas.get_wgpu_context()
        self.session = Session(state, studio or Studio(adapter), motion, clock)
        self._preparation = Preparation(self._connect())
        self.session.player.play()
        self.panel = Panel(self.session)
        self._easing = Easing(state.scene.camera)
        self._last_draw = self._last_change = clock()
        self._last_state = state
        self._last_size = (0, 0)
        self._refused: ViewerState | None = None
        self._failures = self._panel_frames = 0
        self.failure: DermisError | None = None
        self._on_panel, self._pressed_left = False, 0.0
        self._open()
        canvas.add_event_handler(self._on_event, *_POINTER, *_KEYS)
        canvas.request_draw(self.draw)

    def draw(self) -> None:
        """Draw a frame into the canvas; a lost device is opened again."""
        try:
            with gpu_failures(self.session.studio.renderer.device):
                self._draw(self._clock())
            self._failures = 0
        except DermisError as error:
            self._recover(error)
        except Exception as error:
            self.session.tell_fault("This frame cannot be drawn", error)
            return  # the next event draws another one
        going_on = not self.is_still and not self._preparation.is_running  # whose end wakes it
        if going_on or self._panel_frames:
            self._panel_frames = max(0, self._panel_frames - 1)
            self.canvas.request_draw()

    @property
    def is_still(self) -> bool:
        """Whether the last picture is final until something changes."""
        state, studio = self.session.shown, self.session.studio
        arrived = self._last_state is state and self._easing.camera == state.scene.camera
        final = studio.is_current or self._refused is state
        there = not self._preparation.is_running
        return there and arrived and final and not self._is_moving(self._clock())

    def _draw(self, now: float) -> None:
        session, size = self.session, self._picture_size()
        session.take_head()
        session.player.advance()
        state, elapsed = session.shown, min(now - self._last_draw, _LONGEST_STEP_S)
        before = self._easing.camera
        camera = self._easing.advance(state.scene.camera, elapsed)
        if state is not self._last_state or camera != before or size != self._last_size:
            self._last_change, self._last_state, self._last_size = now, state, size
        self._last_draw, session.view_size = now, size
        images = self._images(state, camera, size, self._is_moving(now))
        session.status = self._status(size)
        target = self._context.get_current_texture().create_view()
        self._blit.draw(self._patches(*images, size), target)
        self.panel.draw(target, self.canvas.get_logical_size(), self.canvas.get_pixel_ratio())

    def _panel_width(self) -> int:
        """Return the width of the part of the window that the panel covers [pixel]."""
        width = self.panel.width(self.canvas.get_logical_size())
        return round(float(self.canvas.get_pixel_ratio()) * width)

    def _picture_size(self) -> tuple[int, int]:
        """Return the size of the part of the window beside the panel [pixel]."""
        width, height = self.canvas.get_physical_size()
        return max(1, width - self._panel_width()), max(1, height)

    def _patches(self, image: Texture, frozen: Texture | None, size: tuple[int, int]) -> list[Patch]:
        """Return the live picture, and the frozen one left of the divider."""
        left = self._panel_width()
        box = left, 0, *size
        if frozen is None:
            return [Patch(image, box, box)]
        edge = round(self.session.split.share * size[0])
        sides = (frozen, (left, 0, edge, size[1])), (image, (left + edge, 0, size[0] - edge, size[1]))
        return [Patch(one, box, shown) for one, shown in sides if shown[2]]

    def _images(self, state: ViewerState, camera: Camera, size: tuple[int, int], moving: bool) -> Images:
        """Return the live and the frozen picture; a state that cannot be rendered leaves the last picture."""
        import wgpu

        session = self.session
        if state is not self._refused:
            try:
                if kept := self._preparation.picture(session.studio, state):
                    return kept, None
                images = session.studio.pictures(state, session.split.before, camera, size, moving)
                if self._refused:
                    self._refused, session.message = None, ""
                return images
            except DermisError as error:
                if session.studio.last_image is None or isinstance(error, DeviceLostError):
                    raise
                self._refuse(state, str(error))
            except wgpu.GPUError:
                raise  # `draw` tells what it means for the device
            except Exception as error:
                if session.studio.last_image is None:
                    raise
                self._refuse(state)
                session.tell_fault("This cannot be drawn", error)
        assert session.studio.last_image is not None  # or it was raised
        return session.studio.last_image, None

    def _refuse(self, state: ViewerState, message: str = "") -> None:
        self._refused = state
        self.session.message = message

    def _is_moving(self, now: float) -> bool:
        return self.session.player.is_playing or now - self._last_change < _QUIET_S

    def _status(self, size: tuple[int, int]) -> str:
        studio = self.session.studio
        settings = studio.settings
        if self._preparation.is_running:
            return "preparing the head ..."
        if settings is None or studio.rendered is None or not studio.pace.software:
            return ""
        width, height = settings.size
        text = f"software adapter, no GPU: {width} x {height}"
        if studio.is_current and settings.size == size:
            return text
        return f"{text}, atlas {settings.atlas} while moving, refined when still"

    def _on_event(self, event: Event) -> None:
        kind = event["event_type"]
        self._panel_frames = _PANEL_FRAMES
        wanted = self.panel.feed(event, self.canvas.get_logical_size())
        if kind == "pointer_down":
            self._on_panel = wanted
        if not (self._on_panel if kind in ("pointer_move", "pointer_up") else wanted):
            self._on_picture(event)
        if kind == "pointer_up":
            self._on_panel = False
        self.canvas.request_draw()

    def _on_picture(self, event: Event) -> None:
        """Handle an event over the picture, which begins where the panel ended at the press."""
        width, height = self.canvas.get_logical_size()
        left = self.panel.width((width, height))
        if event["event_type"] == "pointer_down":
            self._pressed_left = left
        start = self._pressed_left if event["event_type"] in ("pointer_move", "pointer_up") else left
        moved, size = shifted(event, start), (max(1.0, width - left), height)
        if not self.session.split.handle(moved, size[0]):
            self.session.controls.handle(moved, size)

    def _open(self) -> None:
        """Configure the canvas for the studio's device."""
        device = self.session.studio.renderer.device
        format_ = str(self._context.get_preferred_format(device.adapter.handle)).removesuffix("-srgb")
        self._context.configure(device=device.handle, format=format_)
        self._blit = Blit(device, format_)
        self.panel.open(device, format_)

    def _connect(self) -> Callable[[], None]:
        """Let files come from and go to a page, which may be on another machine; returns what wakes it."""
        canvas, session = self.canvas, self.session
        session.offer = getattr(canvas, "offer", None)
        session.ask_for_file = getattr(canvas, "ask_for_file", None)
        if session.ask_for_file:
            canvas.on_file = lambda path, name: session.heads.open(str(path), name)
        loop = canvas._rc_canvas_group.get_loop()
        session.heads.wake = lambda: loop and loop.call_soon_threadsafe(canvas.request_draw)
        return session.heads.wake

    def _recover(self, error: DermisError) -> None:
        """Open the device again after it was lost or ran out of memory."""
        import wgpu

        self._failures += 1
        with contextlib.suppress(wgpu.GPUError):  # releases the texture of the old device
            self._context.unconfigure()
        try:
            if self._failures > _MOST_FAILURES:
                raise error.again() if isinstance(error, DeviceLostError) else error
            self.session.studio = Studio(self._adapter)
            self._preparation.forget()
            self._open()
        except DermisError as final:
            self.failure = final
            self.canvas.close()
            return
        self.session.message = "the graphics device was lost and opened again"
        self.canvas.request_draw()
