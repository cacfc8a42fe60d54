"""The viewer on a canvas: the same on the desk, in a browser and in a notebook."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from typing import Any

from dermis.errors import DermisError
from dermis.scene.camera import Camera
from dermis.viewer.blit import Blit, Patch
from dermis.viewer.desk import Desk
from dermis.viewer.easing import Easing
from dermis.viewer.panel.input import shifted
from dermis.viewer.panel.panel import Panel
from dermis.viewer.state import ViewerState
from dermis.viewer.studio import Studio

_QUIET_S = 0.25  # without a change: then the picture is refined
_LONGEST_STEP_S = 0.2
_MOST_FAILURES = 3
_HANDLED = (
    "pointer_down",
    "pointer_move",
    "pointer_up",
    "pointer_leave",
    "double_click",
    "wheel",
    "key_down",
    "key_up",
    "char",
)
_ECHOES = 3  # frames that the panel needs to come to rest after an event


class Viewer:
    """A head to turn in one's hands.

    state : what is shown first
    canvas : of rendercanvas, of whatever backend
    adapter : "auto", "cpu" or part of an adapter's name
    clock : time [s]

    `failure` is what closed the canvas when the device could not be opened again.

    Raises DermisError without an adapter or without the extra `viewer`.
    """

    def __init__(
        self,
        state: ViewerState,
        canvas: Any,
        adapter: str = "auto",
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.canvas = canvas
        self._adapter, self._clock = adapter, clock
        self._context = canvas.get_wgpu_context()
        self.desk = Desk(state, Studio(adapter))
        self.panel = Panel(self.desk)
        self._easing = Easing(state.scene.camera)
        self._last_draw = self._last_change = clock()
        self._last_seen = state
        self._last_size = (0, 0)
        self._refused: ViewerState | None = None
        self._failures = self._echoes = 0
        self.failure: Exception | None = None
        self._on_panel = False
        self._open()
        canvas.add_event_handler(self._on_event, *_HANDLED)
        canvas.request_draw(self.draw)

    def draw(self) -> None:
        """Draw a frame into the canvas; a device that was lost is opened again."""
        import wgpu

        try:
            self._draw(self._clock())
            self._failures = 0
        except (wgpu.GPUError, DermisError) as error:
            self._recover(error)
        if not self.is_still or self._echoes:
            self._echoes = max(0, self._echoes - 1)
            self.canvas.request_draw()

    @property
    def is_still(self) -> bool:
        """Whether the last picture is final until something changes."""
        same = self._last_seen is self.desk.state and self._easing.camera == self.desk.state.scene.camera
        final = self.desk.studio.is_current or self._refused is self.desk.state
        return same and final and not self._is_moving(self._clock())

    def _repr_mimebundle_(self, **options: Any) -> Any:
        """What a notebook shows."""
        return self.canvas._repr_mimebundle_(**options)

    def _draw(self, now: float) -> None:
        desk, size = self.desk, self._free_size()
        state, elapsed = desk.state, min(now - self._last_draw, _LONGEST_STEP_S)
        before = self._easing.camera
        camera = self._easing.advance(state.scene.camera, elapsed)
        if state is not self._last_seen or camera != before or size != self._last_size:
            self._last_change, self._last_seen, self._last_size = now, state, size
        self._last_draw = now
        moving = self._is_moving(now) or desk.studio.is_searching
        images = self._images(state, camera, size, moving)
        desk.messages.status = self._status(size)
        target = self._context.get_current_texture().create_view()
        self._blit.draw(self._patches(*images, size), target)
        self.panel.draw(target, self.canvas.get_logical_size(), self.canvas.get_pixel_ratio())

    def _covered(self) -> int:
        """Columns at the left that are the panel's [pixel]."""
        width = self.panel.width(self.canvas.get_logical_size())
        return round(float(self.canvas.get_pixel_ratio()) * width)

    def _free_size(self) -> tuple[int, int]:
        """Of the picture, beside the panel [pixel]."""
        width, height = self.canvas.get_physical_size()
        return max(1, width - self._covered()), max(1, height)

    def _patches(self, image: Any, frozen: Any, size: tuple[int, int]) -> list[Patch]:
        """The live picture, and the frozen one left of the divider."""
        left, box = self._covered(), (self._covered(), 0, *size)
        if frozen is None:
            return [Patch(image, box, box)]
        edge = round(self.desk.split.share * size[0])
        sides = (frozen, (left, 0, edge, size[1])), (image, (left + edge, 0, size[0] - edge, size[1]))
        return [Patch(one, box, shown) for one, shown in sides if shown[2]]

    def _images(
        self, state: ViewerState, camera: Camera, size: tuple[int, int], moving: bool
    ) -> tuple[Any, Any]:
        """The pictures of a state and of the frozen one; a state that cannot be rendered leaves the last."""
        import wgpu

        studio = self.desk.studio
        if state is not self._refused:
            try:
                images = studio.pictures(state, self.desk.split.before, camera, size, moving)
                if self._refused:  # what was wrong is so no more
                    self._refused, self.desk.messages.said = None, ""
                return images
            except DermisError as error:
                if studio.last_image is None or isinstance(error.__cause__, wgpu.GPUError):
                    raise
                self._refused = state
                self.desk.messages.said = str(error)
        return studio.last_image, None

    def _is_moving(self, now: float) -> bool:
        return now - self._last_change < _QUIET_S

    def _status(self, size: tuple[int, int]) -> str:
        studio = self.desk.studio
        settings, rendered = studio.settings, studio.rendered
        if settings is None or rendered is None or not studio.pace.software:
            return ""
        width, height = settings.size
        what = "software adapter, no GPU"
        if studio.is_current and settings.size == size:
            return f"{what}: {width} x {height}"
        return f"{what}: {width} x {height}, atlas {settings.atlas} while moving, refined when still"

    def _on_event(self, event: dict[str, Any]) -> None:
        kind = event["event_type"]
        self._echoes = _ECHOES
        wanted = self.panel.feed(event, self.canvas.get_logical_size())
        if kind == "pointer_down":
            self._on_panel = wanted
        ours = not self._on_panel if kind in ("pointer_move", "pointer_up") else not wanted
        if ours:
            self._on_picture(event)
        if kind == "pointer_up":
            self._on_panel = False
        self.canvas.request_draw()

    def _on_picture(self, event: dict[str, Any]) -> None:
        """An event of the picture, whose left edge is where the panel ends."""
        width, height = self.canvas.get_logical_size()
        left = self.panel.width((width, height))
        moved, size = shifted(event, left), (max(1.0, width - left), height)
        if not self.desk.split.handle(moved, size[0]):
            self.desk.controls.handle(moved, size)

    def _open(self) -> None:
        """Set the canvas up for the studio's device."""
        device = self.desk.studio.renderer.device
        format_ = str(self._context.get_preferred_format(device.adapter.handle)).removesuffix("-srgb")
        self._context.configure(device=device.handle, format=format_)
        self._blit = Blit(device, format_)
        self.panel.open(device, format_)

    def _recover(self, error: Exception) -> None:
        """Open the device again: it was lost, or its memory was used up."""
        import wgpu

        self._failures += 1
        if self._failures > _MOST_FAILURES:
            self.failure = error
            self.canvas.close()
            return
        with contextlib.suppress(wgpu.GPUError):  # drops the texture of the old device
            self._context.unconfigure()
        self.desk.studio = Studio(self._adapter)
        self._open()
        self.desk.messages.said = "the graphics device was lost and opened again"
        self.canvas.request_draw()
