"""Rendering of viewer states, at reduced quality while the picture changes; preparation of new heads."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.viewer.state import (
    ATLAS_VIEW_NAME,
    LIGHT_COMPONENT_VIEWS,
    PICTURE_VIEW_NAME,
    ViewerState,
    states_equal,
    validated_copy,
)
from dermis.apps.viewer.views import IntermediateViews
from dermis.base.background import run_in_thread
from dermis.base.errors import refuse
from dermis.frame.rendered_frame import RenderedFrame
from dermis.frame.renderer import Renderer
from dermis.gpu import Device, Texture, download, make_texture
from dermis.images.io import write_image, write_png
from dermis.mesh.mesh import Mesh
from dermis.scene.camera import Camera
from dermis.scene.settings import MAX_SAMPLE_COUNT, Settings

# time of a frame in motion on a software adapter and on a GPU
_FRAME_BUDGET_MS_BY_IS_SOFTWARE = {True: 100.0, False: 33.0}
_SLOW_FRAME_RATIO, _FAST_FRAME_RATIO = (
    1.25,
    0.45,
)  # ratios of frame time to budget at which the quality changes
_FRAME_STREAK_LENGTH = (
    2  # consecutive slow or fast frames before a change; a single one may have relit the atlas
)


@dataclass(frozen=True)
class Quality:
    """Upper limits of render settings while the picture changes; a still picture has no limits.

    scale : factor by which the width and height of the image are multiplied [-]
    samples, atlas, shadow_size : maximum values of the fields of `Settings` with these names
    """

    scale: float
    samples: int
    atlas: int
    shadow_size: int


_NO_LIMIT = 1 << 14
QUALITY_LEVELS = (
    Quality(1.0, _NO_LIMIT, _NO_LIMIT, _NO_LIMIT),
    Quality(1.0, 2, 1024, 1024),
    Quality(1.0, 1, 512, 512),
    Quality(0.75, 1, 512, 512),
    Quality(0.5, 1, 256, 512),
    Quality(0.35, 1, 256, 256),
)
_BEST_QUALITY_LEVEL_ON_CPU = 2


class QualityController:
    """Controller that adapts the quality of a changing picture to the time that the last frames took.

    software : whether the adapter renders on the CPU
    """

    def __init__(self, is_software_adapter: bool) -> None:
        self.software = is_software_adapter
        self._budget_ms = _FRAME_BUDGET_MS_BY_IS_SOFTWARE[is_software_adapter]
        self._level = self._best_level = _BEST_QUALITY_LEVEL_ON_CPU if is_software_adapter else 0
        self._streak = 0

    @property
    def quality(self) -> Quality:
        """Return the quality limits of the next frame, which apply only while the picture is changing."""
        return QUALITY_LEVELS[self._level]

    def record_frame_time(self, frame_ms: float) -> None:
        """Record the time of a frame of a changing picture; change the quality after slow or fast frames.

        frame_ms : time from recording the frame's commands to their completion [ms]
        """
        is_slow = frame_ms > _SLOW_FRAME_RATIO * self._budget_ms
        is_fast = frame_ms < _FAST_FRAME_RATIO * self._budget_ms
        step = is_slow - is_fast
        self._streak = self._streak + step if step * self._streak >= 0 else step
        if not step:
            self._streak = 0
        if abs(self._streak) >= _FRAME_STREAK_LENGTH:
            self._level = max(self._best_level, min(len(QUALITY_LEVELS) - 1, self._level + step))
            self._streak = 0

    def limited_settings(self, settings: Settings, view_size: tuple[int, int], is_moving: bool) -> Settings:
        """Return the settings of a frame for a view size, with limited quality while the picture changes.

        is_moving : whether the picture is changing
        """
        quality = self.quality if is_moving else QUALITY_LEVELS[0]
        width, height = (max(1, round(quality.scale * side)) for side in view_size)
        return validated_copy(
            settings,
            size=(width, height),
            samples=min(settings.samples, quality.samples, max(1, MAX_SAMPLE_COUNT // (width * height))),
            atlas=min(settings.atlas, quality.atlas),
            shadow_size=min(settings.shadow_size, quality.shadow_size),
        )


LiveAndFrozenImages = tuple[Texture, Texture | None]
"""Image of the live state, and image of the frozen state; None if no state is frozen."""
_CACHED_RESOURCE_SETS = 2  # resources for frames in motion and for still frames
_PREPARATION_FRAME_SIZE = (96, 64)  # size of small frames that use all shaders [pixel]
_TIMED_FRAME_COUNT = 120
_FROZEN_DIVIDER_SIDE = (
    "before"  # name of its atlas light, kept apart so that a moving camera relights neither side
)


@dataclass(frozen=True)
class FrozenImage:
    """Image of a frozen state, with the camera and settings that it was rendered with."""

    state: ViewerState
    camera: Camera
    settings: Settings
    image: Texture


class ViewRenderer:
    """Renderer of viewer states that recomputes only what has changed and keeps the last image.

    adapter : "auto", "cpu" or part of an adapter's name

    is_preparing : whether `prepare` is running; no other method may render during that time
    """

    def __init__(self, adapter: str = "auto") -> None:
        self.is_preparing = False
        self.renderer = Renderer(adapter, cache_size=_CACHED_RESOURCE_SETS, reopens_lost_device=False)
        self.quality_controller = QualityController(
            is_software_adapter=self.renderer.device.adapter.kind == "CPU"
        )
        self.rendered: RenderedFrame | None = None
        self.settings: Settings | None = None
        self._views = IntermediateViews(self.renderer)
        self._image_inputs: tuple[ViewerState, Camera, Settings] | None = None
        self.last_image: Texture | None = None
        self._size = (0, 0)
        self.stage_times: deque[dict[str, float]] = deque(maxlen=_TIMED_FRAME_COUNT)
        self._frozen: FrozenImage | None = None
        self._atlas_state: tuple[ViewerState, str] | None = None

    def prepare(self, state: ViewerState, on_resources_ready: Callable[[], None] = lambda: None) -> None:
        """Create all resources and shaders for a state by rendering small images of it.

        on_resources_ready : function called when the resources of the head have been created

        Raises DermisError if the state cannot be rendered or the device fails.
        """
        self.is_preparing = True
        try:
            for moving in (True, False):
                self.renderer.prepare(
                    state.scene, self._frame_settings(state, _PREPARATION_FRAME_SIZE, moving)
                )
            on_resources_ready()
            for moving in (True, False):
                self.render_image(state, state.scene.camera, _PREPARATION_FRAME_SIZE, moving)
        finally:
            self.is_preparing = False

    def render_images(
        self,
        state: ViewerState,
        frozen_state: ViewerState | None,
        camera: Camera,
        view_size: tuple[int, int],
        is_moving: bool,
    ) -> LiveAndFrozenImages:
        """Return the images of the live state and of the frozen state (None if there is no frozen state).

        camera : camera to use instead of the cameras of both states
        view_size : size of the view; while the picture is changing, the images may be smaller [pixel]
        is_moving : whether the picture is changing; if so, its quality is limited

        Raises DermisError if a state cannot be rendered or the device fails.
        """
        if frozen_state is None:
            self._frozen = None
            return self.render_image(state, camera, view_size, is_moving), None
        image = self._frozen_image(frozen_state, camera, view_size, is_moving)
        return self.render_image(state, camera, view_size, is_moving), image

    def render_image(
        self, state: ViewerState, camera: Camera, view_size: tuple[int, int], is_moving: bool
    ) -> Texture:
        """Return a texture of sRGB bytes for a state; the last texture is reused if nothing has changed.

        camera : camera to use instead of the camera of the state
        view_size : size of the view; while the picture is changing, the texture may be smaller [pixel]
        is_moving : whether the picture is changing; if so, its quality is limited

        Raises DermisError if the state cannot be rendered or the device fails.
        """
        self._size = view_size
        settings = self._frame_settings(state, view_size, is_moving)
        inputs = self._image_inputs
        is_cached = inputs and inputs[0] is state and inputs[1:] == (camera, settings)
        if is_cached and self.last_image is not None:
            return self.last_image
        last_rendered = self.rendered
        self.last_image = self._draw(replace(state, settings=settings).with_camera(camera))
        self._image_inputs = state, camera, settings
        if self.rendered and self.rendered is not last_rendered:
            self.stage_times.append(self.rendered.gpu_ms or {})
            stages = self.rendered.gpu_ms or {"shade"}
            if is_moving and "shade" in stages:  # times of frames without shading do not predict the next one
                self.quality_controller.record_frame_time(self.rendered.frame_ms)
        return self.last_image

    def _frozen_image(
        self, frozen_state: ViewerState, camera: Camera, view_size: tuple[int, int], is_moving: bool
    ) -> Texture:
        """Return a copy of the image of the frozen state, reused until the camera or the settings change."""
        settings, frozen = self._frame_settings(frozen_state, view_size, is_moving), self._frozen
        still_settings = self._frame_settings(frozen_state, view_size, is_moving=False)
        is_cached = frozen and frozen.state is frozen_state and frozen.camera == camera
        if frozen and is_cached and frozen.settings in (settings, still_settings):
            return frozen.image
        image = self._draw(replace(frozen_state, settings=settings).with_camera(camera), _FROZEN_DIVIDER_SIDE)
        self._image_inputs = None  # the texture held the image of the live state
        image_copy = copy_texture(self.renderer.device, image, frozen.image if frozen else None)
        self._frozen = FrozenImage(frozen_state, camera, settings, image_copy)
        return image_copy

    def _frame_settings(self, state: ViewerState, view_size: tuple[int, int], is_moving: bool) -> Settings:
        """Return the settings of a frame, with limited quality while the picture changes.

        In the atlas view, the quality is never limited.
        """
        return self.quality_controller.limited_settings(
            state.settings, view_size, is_moving and state.view != ATLAS_VIEW_NAME
        )

    @property
    def has_full_quality(self) -> bool:
        """Return whether the last image has the full quality of a still image."""
        if not self._image_inputs:
            return False
        state, _, settings = self._image_inputs
        return self._frame_settings(state, self._size, is_moving=False) == settings

    def screenshot(self, picture_path: Path, state: ViewerState, picture_size: tuple[int, int]) -> None:
        """Render the view of a state to a file: .png (tone-mapped) or .exr (linear).

        picture_size : width and height of the picture [pixel]

        Raises DermisError if the picture cannot be rendered or written.
        """
        if self.is_preparing:
            refuse("picture", "a head that is ready", "it is being prepared", "Try again in a moment")
        image = self._draw(state.with_settings(size=picture_size))
        self._image_inputs = None
        is_linear, rendered = picture_path.suffix.lower() == ".exr", self.rendered
        if not rendered or state.view not in (PICTURE_VIEW_NAME, *LIGHT_COMPONENT_VIEWS):
            write_png(picture_path, self.download_image(image))
        elif state.settings.background == "none":
            write_image(picture_path, rendered.linear_rgba()) if is_linear else write_png(
                picture_path, rendered.rgba8()
            )
        else:
            write_image(picture_path, rendered.linear()) if is_linear else write_png(
                picture_path, self.download_image(image)
            )

    @property
    def exposure(self) -> float:
        """Return the exposure factor of the last frame, whether metered or fixed [-]."""
        return self.rendered.exposure if self.rendered else 1.0

    def download_image(self, image: Texture) -> NDArray[np.uint8]:
        """Download an image from the device, and return it as sRGB bytes (h, w, 3)."""
        return np.ascontiguousarray(download(self.renderer.device, image)[..., :3])

    def _draw(self, state: ViewerState, divider_side: str = "") -> Texture:
        parts = LIGHT_COMPONENT_VIEWS.get(state.view, state.settings.parts)
        settings = self.settings = validated_copy(state.settings, parts=parts)
        if state.view == ATLAS_VIEW_NAME and self._atlas_shows_state(state, divider_side):
            return self._views.draw_atlas(state.scene, settings, state.atlas_view, divider_side)
        self._atlas_state = None
        self.rendered = self.renderer.draw(state.scene, settings, view=divider_side)
        self._atlas_state = state, divider_side
        if state.view in (PICTURE_VIEW_NAME, *LIGHT_COMPONENT_VIEWS):
            return self.rendered.picture.bytes
        if state.view == ATLAS_VIEW_NAME:
            return self._views.draw_atlas(state.scene, settings, state.atlas_view, divider_side)
        return self._views.draw(state.scene, settings, state.view, divider_side)

    def _atlas_shows_state(self, state: ViewerState, divider_side: str) -> bool:
        """Return whether the atlas already contains the maps of a state, so no frame needs to be rendered.

        divider_side : "before" for the frozen state left of the divider, "" for the live state
        """
        if self._atlas_state is None or self._atlas_state[1] != divider_side:
            return False
        return states_equal(replace(self._atlas_state[0], atlas_view=state.atlas_view), state)


def copy_texture(device: Device, source_texture: Texture, target_texture: Texture | None = None) -> Texture:
    """Copy a texture with 8-bit channels, and return the copy.

    target_texture : texture to reuse if its size matches
    """
    if target_texture is None or target_texture.size != source_texture.size:
        target_texture = make_texture(device, source_texture.size[:2], "rgba8uint")
    encoder = device.handle.create_command_encoder()
    encoder.copy_texture_to_texture(
        {"texture": source_texture}, {"texture": target_texture}, source_texture.size
    )
    device.handle.queue.submit([encoder.finish()])
    return target_texture


class HeadPreparation:
    """Preparation of new heads for rendering, one at a time, in a separate thread.

    No frame is drawn while a head is being prepared.

    request_frame : function that requests a frame, called from the separate thread after each preparation
    """

    def __init__(self, request_frame: Callable[[], None]) -> None:
        self._request_frame = request_frame
        self._ready_mesh: Mesh | None = None  # other maps of this mesh need no preparation
        self._future: Future[None] | None = None
        self._next_mesh: Mesh | None = None
        self._held_image: Texture | None = None

    @property
    def is_running(self) -> bool:
        """Return whether a head is being prepared, or has been prepared but not yet drawn."""
        return self._future is not None

    def reset(self) -> None:
        """Discard the prepared meshes and the image shown during preparation."""
        self._ready_mesh = self._future = self._next_mesh = self._held_image = None

    def prepare_head(self, view_renderer: ViewRenderer, state: ViewerState) -> Texture | None:
        """Prepare the head of a state in a thread, unless the head is ready to be drawn.

        The result is None if the head is ready, or else the last image, to be shown during the preparation.

        view_renderer : renderer that prepares the head, and that rendered the last image

        Raises the exception, if any, that stopped the preparation.
        """
        if self._future is not None:
            if not self._future.done():
                return self._held_image
            future, self._future, self._held_image = self._future, None, None
            self._ready_mesh = self._next_mesh
            future.result()
        mesh = state.scene.head.mesh
        if view_renderer.last_image is None or mesh is self._ready_mesh:
            self._ready_mesh = mesh
            return None
        self._held_image = copy_texture(view_renderer.renderer.device, view_renderer.last_image)
        self._next_mesh, view_renderer.is_preparing = mesh, True
        self._future = run_in_thread(lambda: view_renderer.prepare(state))
        self._future.add_done_callback(lambda _: self._request_frame())
        return self._held_image
