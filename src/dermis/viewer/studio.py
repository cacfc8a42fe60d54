"""From states to images on the device."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.gpu import download
from dermis.images.io import write_image, write_png
from dermis.rendering.rendered import Rendered
from dermis.rendering.renderer import Renderer
from dermis.scene.camera import Camera
from dermis.scene.settings import Settings
from dermis.viewer.pace import Pace
from dermis.viewer.state import PICTURE, ViewerState, changed
from dermis.viewer.views import PARTS, Views

_SIZES = 2  # of everything: for frames in motion and for still ones


class Studio:
    """A renderer that computes only what has changed, and the last image it made.

    adapter : "auto", "cpu" or part of an adapter's name
    """

    def __init__(self, adapter: str = "auto") -> None:
        self.renderer = Renderer(adapter, depth=_SIZES)
        self.pace = Pace(software=self.renderer.device.adapter.kind == "CPU")
        self.rendered: Rendered | None = None
        self.settings: Settings | None = None
        self._views = Views(self.renderer)
        self._shown: tuple[ViewerState, Camera, Settings] | None = None
        self.last_image: Any = None
        self._size = (0, 0)

    def image(self, state: ViewerState, camera: Camera, size: tuple[int, int], moving: bool) -> Any:
        """A texture of sRGB bytes, of the window's size or smaller in motion; the last one where it holds.

        Raises DermisError for states that cannot be rendered and when the device fails.
        """
        self._size = size
        settings = self.pace.settings(state.settings, size, moving)
        if self._shown and self._shown[0] is state and self._shown[1:] == (camera, settings):
            return self.last_image
        self.last_image = self._draw(replace(state, settings=settings).with_camera(camera))
        self._shown = state, camera, settings
        if moving and self.rendered:
            self.pace.note(self.rendered.frame_ms)
        return self.last_image

    @property
    def is_current(self) -> bool:
        """Whether the last image is a still one, with all that its settings ask for."""
        if not self._shown:
            return False
        state, _, settings = self._shown
        return self.pace.settings(state.settings, self._size, moving=False) == settings

    def screenshot(self, path: Path, state: ViewerState, size: tuple[int, int]) -> None:
        """Write what the state shows at any size: .png with the tone curve, or .exr, linear.

        Raises DermisError when that is not possible.
        """
        image = self._draw(state.with_settings(size=size))
        self._shown = None
        if path.suffix.lower() == ".exr" and self.rendered and state.view in (PICTURE, *PARTS):
            write_image(path, self.rendered.linear())
        else:
            write_png(path, self.read(image))

    def read(self, image: Any) -> NDArray[np.uint8]:
        """(h, w, 3) bytes of an image."""
        return np.ascontiguousarray(download(self.renderer.device, image)[..., :3])

    def _draw(self, state: ViewerState) -> Any:
        parts = PARTS.get(state.view, state.settings.parts)
        settings = changed(state.settings, parts=parts)
        self.rendered = self.renderer.draw(state.scene, settings, keep_light=True)
        self.settings = settings
        if state.view in (PICTURE, *PARTS):
            return self.rendered.picture.bytes
        return self._views.draw(state.scene, settings, state.view)
