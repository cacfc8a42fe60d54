"""Renderer and head shared by all gallery scripts."""

from __future__ import annotations

from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.formats.samples import is_available
from dermis.frame.features.surface.painting.painted_head import with_painted_maps
from dermis.frame.rendered_frame import RenderedFrame
from dermis.frame.renderer import Renderer
from dermis.mesh.head import Head
from dermis.scene.heads import HUMAN, load_head
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

_SCAN = "lee_perry_smith"


class Studio:
    """Renderer, and the head that pictures show.

    name : head to show; by default the scan if it is downloaded, else the human
    side : of a panel [pixel]
    settings : fields of `Settings` that override those of scripts
    """

    def __init__(
        self, name: str | None = None, side: int = 448, adapter: str = "auto", **settings: Any
    ) -> None:
        self.name = name or (_SCAN if is_available(_SCAN) else HUMAN)
        self.side, self.adapter, self._settings = side, adapter, settings
        self.frames_ms: list[float] = []
        self._load = cache(load_head)

    @cached_property
    def renderer(self) -> Renderer:
        """Return the renderer, opened on first use."""
        return Renderer(self.adapter)

    def head(self, name: str | None = None, **options: Any) -> Head:
        """Return the head to show, or another one, subdivided once.

        options : of `load_head`
        """
        return self._load(name or self.name, subdivide=1, **options)

    def coloured_head(self) -> Head:
        """Return the head to show with its colours as a map, even if the device paints them."""
        head = self.head()
        return with_painted_maps(self.renderer.device, head, 1024) if head.maps.is_painted else head

    def render(self, scene: Scene, scale: float = 1.0, **settings: Any) -> NDArray[np.uint8]:
        """Return (h, w, 3) sRGB bytes of a scene.

        scale : factor by which the side of the panel is multiplied
        settings : fields of `Settings`
        """
        return self._draw(scene, scale, settings).srgb8()

    def linear(self, scene: Scene, scale: float = 1.0, **settings: Any) -> NDArray[np.float32]:
        """Return (h, w, 3) linear Rec. 709 of a scene: `render` before encoding."""
        return self._draw(scene, scale, settings).linear()

    def view(self, scene: Scene, view: str, scale: float = 1.0, **settings: Any) -> NDArray[np.uint8]:
        """Return (h, w, 3) sRGB bytes of an intermediate result as the viewer shows it.

        view : name in the viewer, such as "blur 3"
        """
        from dermis.apps.viewer.state import PARTS
        from dermis.apps.viewer.views import IntermediateViews
        from dermis.gpu import download

        if view in ("picture", *PARTS):
            return self.render(scene, scale, parts=PARTS.get(view, "all"), **settings)

        def draw_view() -> NDArray[np.uint8]:
            self._draw(scene, scale, settings)
            texture = IntermediateViews(self.renderer).draw(scene, self.settings(scale, **settings), view)
            return np.asarray(download(self.renderer.device, texture), np.uint8)[..., :3]

        return self.renderer.reopening_device.run(draw_view)

    def light_map(self, scene: Scene, level: int, **settings: Any) -> NDArray[np.float32]:
        """Return (n, n, 3) light on the atlas, as irradiance over pi.

        level : 0 for the light that enters, higher ones for blurred levels
        """
        from dermis.gpu import download

        def read_light() -> NDArray[np.float32]:
            self._draw(scene, 1.0, settings)
            inputs = self.renderer.prepare(scene, self.settings(**settings))
            levels, blur = inputs.resources.diffusion.levels, inputs.blurs[0]
            layer = blur.profile_levels[level]
            halved = blur.halvings[layer]
            light = download(self.renderer.device, levels.stacks[halved], layer=layer - levels.first[halved])
            return np.asarray(light, np.float32)[..., :3] / np.float32(blur.scale)

        return self.renderer.reopening_device.run(read_light)

    def settings(self, scale: float = 1.0, **settings: Any) -> Settings:
        """Return the settings of a panel."""
        side = round(scale * self.side)
        defaults: dict[str, Any] = {"size": (side, side), "atlas": 1024}
        return Settings(**(defaults | settings | self._settings))

    def _draw(self, scene: Scene, scale: float, settings: dict[str, Any]) -> RenderedFrame:
        rendered = self.renderer.draw(scene, self.settings(scale, **settings))
        self.frames_ms.append(rendered.frame_ms)
        return rendered
