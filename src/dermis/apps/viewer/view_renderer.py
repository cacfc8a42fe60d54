"""From states to images on the device: pacing of frames in motion, and preparation of other heads."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.apps.viewer.state import ATLAS, PARTS, PICTURE, ViewerState, changed, same
from dermis.apps.viewer.views import Views
from dermis.base.errors import refuse
from dermis.frame.rendered import Rendered
from dermis.frame.renderer import Renderer
from dermis.gpu import Device, Texture, download, make_texture
from dermis.images.io import write_image, write_png
from dermis.mesh.mesh import Mesh
from dermis.scene.camera import Camera
from dermis.scene.settings import MOST_WORK, Settings

_BUDGET_MS = {True: 100.0, False: 33.0}  # of a frame in motion, on a software adapter and on a GPU
_MOST_MS_OVER, _LEAST_SHARE = 1.25, 0.45
_PATIENCE = 2  # slow or fast frames in a row before a change: a single one may have lit the atlas again


@dataclass(frozen=True)
class Quality:
    """Quality limits of a frame in motion; a still one has all that the settings ask for.

    scale : of the image's sides
    samples, atlas, shadow_size : maxima
    """

    scale: float
    samples: int
    atlas: int
    shadow_size: int


_ALL = 1 << 14
QUALITY_LEVELS = (
    Quality(1.0, _ALL, _ALL, _ALL),
    Quality(1.0, 2, 1024, 1024),
    Quality(1.0, 1, 512, 512),
    Quality(0.75, 1, 512, 512),
    Quality(0.5, 1, 256, 512),
    Quality(0.35, 1, 256, 256),
)
_FIRST_ON_SOFTWARE = 2


class Pace:
    """Chooses the quality of frames in motion from the time that the last ones took.

    software : whether the adapter renders on the CPU
    """

    def __init__(self, software: bool) -> None:
        self.software = software
        self._budget_ms = _BUDGET_MS[software]
        self._level = self._first = _FIRST_ON_SOFTWARE if software else 0
        self._streak = 0

    @property
    def quality(self) -> Quality:
        """Quality of the next frame in motion."""
        return QUALITY_LEVELS[self._level]

    def note(self, frame_ms: float) -> None:
        """Record the time of the last frame in motion, without preparation [ms]."""
        slow, fast = frame_ms > _MOST_MS_OVER * self._budget_ms, frame_ms < _LEAST_SHARE * self._budget_ms
        wish = slow - fast
        self._streak = self._streak + wish if wish * self._streak >= 0 else wish
        if not wish:
            self._streak = 0
        if abs(self._streak) >= _PATIENCE:
            self._level = max(self._first, min(len(QUALITY_LEVELS) - 1, self._level + wish))
            self._streak = 0

    def settings(self, wanted: Settings, size: tuple[int, int], moving: bool) -> Settings:
        """Return the settings of a frame for a window of that size."""
        quality = self.quality if moving else QUALITY_LEVELS[0]
        width, height = (max(1, round(quality.scale * side)) for side in size)
        return changed(
            wanted,
            size=(width, height),
            samples=min(wanted.samples, quality.samples, max(1, MOST_WORK // (width * height))),
            atlas=min(wanted.atlas, quality.atlas),
            shadow_size=min(wanted.shadow_size, quality.shadow_size),
        )


Images = tuple[Texture, Texture | None]
"""The live picture and that of a frozen state, None without."""
_SIZES = 2  # of everything: for frames in motion and for still ones
_SMALL = (96, 64)  # a picture that needs all shaders and little time
_TIMED_FRAMES = 120
_BEFORE = "before"  # the frozen state's own light, so that a camera that moves lights neither again


@dataclass(frozen=True)
class Frozen:
    """The image of a state that does not change, as the camera saw it."""

    state: ViewerState
    camera: Camera
    settings: Settings
    image: Texture


class Studio:
    """A renderer that computes only what has changed, and the last image it made.

    adapter : "auto", "cpu" or part of an adapter's name

    is_preparing : whether `prepare` runs, perhaps in another thread, when nothing else may be drawn
    """

    def __init__(self, adapter: str = "auto") -> None:
        self.is_preparing = False
        self.renderer = Renderer(adapter, depth=_SIZES, reopens=False)
        self.pace = Pace(software=self.renderer.device.adapter.kind == "CPU")
        self.rendered: Rendered | None = None
        self.settings: Settings | None = None
        self._views = Views(self.renderer)
        self._shown: tuple[ViewerState, Camera, Settings] | None = None
        self.last_image: Texture | None = None
        self._size = (0, 0)
        self.times: deque[dict[str, float]] = deque(maxlen=_TIMED_FRAMES)
        self._frozen: Frozen | None = None
        self._lit: tuple[ViewerState, str] | None = None

    def prepare(self, state: ViewerState, go_on: Callable[[], None] = lambda: None) -> None:
        """Make the resources and shaders of the first pictures of a state, in motion and still.

        go_on : called when the head's resources are there

        Raises DermisError for states that cannot be rendered and when the device fails.
        """
        self.is_preparing = True
        try:
            for moving in (True, False):
                self.renderer.prepare(state.scene, self._settings(state, _SMALL, moving))
            go_on()
            for moving in (True, False):
                self.image(state, state.scene.camera, _SMALL, moving)
        finally:
            self.is_preparing = False

    def pictures(
        self,
        state: ViewerState,
        before: ViewerState | None,
        camera: Camera,
        size: tuple[int, int],
        moving: bool,
    ) -> Images:
        """Return the image of a state as `image` makes it, and that of a frozen one, None without.

        Raises DermisError for states that cannot be rendered and when the device fails.
        """
        if before is None:
            self._frozen = None
            return self.image(state, camera, size, moving), None
        image = self._frozen_image(before, camera, size, moving)
        return self.image(state, camera, size, moving), image

    def image(self, state: ViewerState, camera: Camera, size: tuple[int, int], moving: bool) -> Texture:
        """Return a texture of sRGB bytes, of the window's size or smaller in motion, or the last one.

        Raises DermisError for states that cannot be rendered and when the device fails.
        """
        self._size = size
        settings = self._settings(state, size, moving)
        known = self._shown and self._shown[0] is state and self._shown[1:] == (camera, settings)
        if known and self.last_image is not None:
            return self.last_image
        before = self.rendered
        self.last_image = self._draw(replace(state, settings=settings).with_camera(camera))
        self._shown = state, camera, settings
        if self.rendered and self.rendered is not before:
            self.times.append(self.rendered.gpu_ms or {})
            stages = self.rendered.gpu_ms or {"shade"}
            if moving and "shade" in stages:  # other frames tell nothing about the next one
                self.pace.note(self.rendered.frame_ms)
        return self.last_image

    def _frozen_image(
        self, before: ViewerState, camera: Camera, size: tuple[int, int], moving: bool
    ) -> Texture:
        """Return a copy, as the renderer has one picture of a size; drawn again when the camera moves."""
        settings, frozen = self._settings(before, size, moving), self._frozen
        finest = self._settings(before, size, moving=False)
        known = frozen and frozen.state is before and frozen.camera == camera
        if frozen and known and frozen.settings in (settings, finest):
            return frozen.image
        drawn = self._draw(replace(before, settings=settings).with_camera(camera), _BEFORE)
        self._shown = None  # the picture was the live state's
        copy = copied(self.renderer.device, drawn, frozen.image if frozen else None)
        self._frozen = Frozen(before, camera, settings, copy)
        return copy

    def _settings(self, state: ViewerState, size: tuple[int, int], moving: bool) -> Settings:
        """Return the settings of a frame; the view of the atlas always has full quality."""
        return self.pace.settings(state.settings, size, moving and state.view != ATLAS)

    @property
    def is_current(self) -> bool:
        """Whether the last image is a still one of full quality."""
        if not self._shown:
            return False
        state, _, settings = self._shown
        return self._settings(state, self._size, moving=False) == settings

    def screenshot(self, path: Path, state: ViewerState, size: tuple[int, int]) -> None:
        """Write what the state shows at any size: .png with the tone curve, or .exr, linear.

        Raises DermisError when that is not possible.
        """
        if self.is_preparing:
            refuse("picture", "a head that can be drawn", "it is being prepared", "Try it again in a moment")
        image = self._draw(state.with_settings(size=size))
        self._shown = None
        linear, made = path.suffix.lower() == ".exr", self.rendered
        if not made or state.view not in (PICTURE, *PARTS):
            write_png(path, self.read(image))
        elif state.settings.background == "none":
            write_image(path, made.linear_rgba()) if linear else write_png(path, made.rgba8())
        else:
            write_image(path, made.linear()) if linear else write_png(path, self.read(image))

    @property
    def exposure(self) -> float:
        """Exposure of the last frame, metered or given."""
        return self.rendered.exposure if self.rendered else 1.0

    def read(self, image: Texture) -> NDArray[np.uint8]:
        """Return the (h, w, 3) bytes of an image."""
        return np.ascontiguousarray(download(self.renderer.device, image)[..., :3])

    def _draw(self, state: ViewerState, side: str = "") -> Texture:
        parts = PARTS.get(state.view, state.settings.parts)
        settings = self.settings = changed(state.settings, parts=parts)
        if state.view == ATLAS and self._shows_light_of(state, side):
            return self._views.draw_chart(state.scene, settings, state.chart, side)
        self._lit = None
        self.rendered = self.renderer.draw(state.scene, settings, view=side)
        self._lit = state, side
        if state.view in (PICTURE, *PARTS):
            return self.rendered.picture.bytes
        if state.view == ATLAS:
            return self._views.draw_chart(state.scene, settings, state.chart, side)
        return self._views.draw(state.scene, settings, state.view, side)

    def _shows_light_of(self, state: ViewerState, side: str) -> bool:
        """Return whether the atlas holds a state's light, so that no frame is needed to show another part."""
        if self._lit is None or self._lit[1] != side:
            return False
        return same(replace(self._lit[0], chart=state.chart), state)


def copied(device: Device, image: Texture, space: Texture | None = None) -> Texture:
    """Return a copy of a texture of bytes.

    space : an older copy, whose place is taken when its size fits
    """
    if space is None or space.size != image.size:
        space = make_texture(device, image.size[:2], "rgba8uint")
    encoder = device.handle.create_command_encoder()
    encoder.copy_texture_to_texture({"texture": image}, {"texture": space}, image.size)
    device.handle.queue.submit([encoder.finish()])
    return space


T = TypeVar("T")


class Preparation:
    """Prepares heads one after the other; meanwhile a studio draws nothing else.

    wake : called from another thread when the next frame may draw
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._ready: Mesh | None = None  # with other maps it takes little more than a frame
        self._coming: Future[None] | None = None
        self._next: Mesh | None = None
        self._kept: Texture | None = None

    @property
    def is_running(self) -> bool:
        """Whether a head is being prepared, or waits for the next frame."""
        return self._coming is not None

    def forget(self) -> None:
        """Drop what was begun, for another studio."""
        self._ready = self._coming = self._next = self._kept = None

    def picture(self, studio: Studio, state: ViewerState) -> Texture | None:
        """Return the last picture while the head of a state is prepared; None when the state may be drawn.

        Raises what stopped the preparation, once.
        """
        if self._coming is not None:
            if not self._coming.done():
                return self._kept
            coming, self._coming, self._kept = self._coming, None, None
            self._ready = self._next
            coming.result()
        mesh = state.scene.head.mesh
        if studio.last_image is None or mesh is self._ready:
            self._ready = mesh
            return None
        self._kept = copied(studio.renderer.device, studio.last_image)
        self._next, studio.is_preparing = mesh, True
        self._coming = begun(lambda: studio.prepare(state))
        self._coming.add_done_callback(lambda _: self._wake())
        return self._kept


def begun(work: Callable[[], T]) -> Future[T]:
    """Run `work` in a thread that an interpreter that exits does not wait for; return its future result."""
    coming: Future[T] = Future()
    coming.set_running_or_notify_cancel()

    def run() -> None:
        try:
            coming.set_result(work())
        except Exception as error:
            coming.set_exception(error)

    threading.Thread(target=run, name="preparing", daemon=True).start()
    return coming
