"""Renderer and head that all gallery scripts share."""

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

_SCANNED_HEAD_NAME = "lee_perry_smith"


class Studio:
    """Renderer and head with which gallery scripts draw their pictures.

    name : name of the head; by default the scan lee_perry_smith if it was downloaded, otherwise the human
    side : width and height of a panel [pixel]
    adapter : "auto", "cpu" or part of the name of an adapter
    settings : fields of `Settings` that override the values chosen by scripts
    """

    def __init__(
        self, head_name: str | None = None, side: int = 448, adapter: str = "auto", **settings: Any
    ) -> None:
        self.name = head_name or (_SCANNED_HEAD_NAME if is_available(_SCANNED_HEAD_NAME) else HUMAN)
        self.side, self.adapter, self._settings = side, adapter, settings
        self.frames_ms: list[float] = []
        self._load = cache(load_head)

    @cached_property
    def renderer(self) -> Renderer:
        """Return the renderer, which is opened on first use."""
        return Renderer(self.adapter)

    def head(self, head_name: str | None = None, **options: Any) -> Head:
        """Load a head, subdivided once.

        head_name : name of the head; by default the head of the gallery
        options : arguments of `load_head`
        """
        return self._load(head_name or self.name, subdivide=1, **options)

    def head_with_colour_map(self) -> Head:
        """Return the gallery's head with a colour map; procedural maps are first painted into textures."""
        head = self.head()
        return with_painted_maps(self.renderer.device, head, 1024) if head.maps.is_painted else head

    def render(self, scene: Scene, scale: float = 1.0, **settings: Any) -> NDArray[np.uint8]:
        """Render a scene to 8-bit sRGB, (h, w, 3).

        scale : width and height of the image, relative to those of a gallery panel [-]
        settings : fields of `Settings`
        """
        return self._draw(scene, scale, settings).srgb8()

    def render_linear(self, scene: Scene, scale: float = 1.0, **settings: Any) -> NDArray[np.float32]:
        """Render a scene to linear Rec. 709, (h, w, 3).

        scale : width and height of the image, relative to those of a gallery panel [-]
        settings : fields of `Settings`
        """
        return self._draw(scene, scale, settings).linear()

    def render_view(
        self, scene: Scene, view_name: str, scale: float = 1.0, **settings: Any
    ) -> NDArray[np.uint8]:
        """Render an intermediate result of a frame to 8-bit sRGB, (h, w, 3), as the viewer does.

        view_name : name of the view in the viewer, such as "blur 3"
        scale : width and height of the image, relative to those of a gallery panel [-]
        settings : fields of `Settings`
        """
        from dermis.apps.viewer.state import LIGHT_COMPONENT_VIEWS
        from dermis.apps.viewer.views import IntermediateViews
        from dermis.gpu import download

        if view_name in ("picture", *LIGHT_COMPONENT_VIEWS):
            return self.render(scene, scale, parts=LIGHT_COMPONENT_VIEWS.get(view_name, "all"), **settings)

        def draw_view() -> NDArray[np.uint8]:
            self._draw(scene, scale, settings)
            texture = IntermediateViews(self.renderer).draw(
                scene, self.settings(scale, **settings), view_name
            )
            return np.asarray(download(self.renderer.device, texture), np.uint8)[..., :3]

        return self.renderer.reopening_device.run(draw_view)

    def light_map(self, scene: Scene, pyramid_level: int, **settings: Any) -> NDArray[np.float32]:
        """Return the irradiance (n, n, 3) in the atlas at one level of blur, divided by pi.

        pyramid_level : level of blur: 0 for unblurred light, higher for more strongly blurred light
        settings : fields of `Settings`
        """
        from dermis.gpu import download

        def download_light_level() -> NDArray[np.float32]:
            self._draw(scene, 1.0, settings)
            inputs = self.renderer.prepare(scene, self.settings(**settings))
            levels, blur = inputs.resources.diffusion.levels, inputs.blurs[0]
            layer = blur.profile_levels[pyramid_level]
            halved = blur.halvings[layer]
            light = download(self.renderer.device, levels.stacks[halved], layer=layer - levels.first[halved])
            return np.asarray(light, np.float32)[..., :3] / np.float32(blur.scale)

        return self.renderer.reopening_device.run(download_light_level)

    def settings(self, scale: float = 1.0, **settings: Any) -> Settings:
        """Return the settings for rendering a gallery panel.

        scale : width and height of the image, relative to those of a gallery panel [-]
        settings : fields of `Settings` that replace the defaults of the gallery
        """
        side = round(scale * self.side)
        defaults: dict[str, Any] = {"size": (side, side), "atlas": 1024}
        return Settings(**(defaults | settings | self._settings))

    def _draw(self, scene: Scene, scale: float, settings: dict[str, Any]) -> RenderedFrame:
        rendered = self.renderer.draw(scene, self.settings(scale, **settings))
        self.frames_ms.append(rendered.frame_ms)
        return rendered
