"""One frame, read from top to bottom."""

from __future__ import annotations

from dermis.gpu import Device, Frame
from dermis.rendering.inputs import Inputs
from dermis.rendering.stages.blend import Blend
from dermis.rendering.stages.bloom import Bloom
from dermis.rendering.stages.combine import Combine
from dermis.rendering.stages.diffuse import Diffuse
from dermis.rendering.stages.irradiance import Irradiance
from dermis.rendering.stages.opposite import Opposite
from dermis.rendering.stages.post import Post
from dermis.rendering.stages.published import Published
from dermis.rendering.stages.screen_space import ScreenSpace
from dermis.rendering.stages.shade import Shade
from dermis.rendering.stages.shadows import Shadows
from dermis.rendering.stages.transmission import Transmission
from dermis.rendering.stages.visibility import Visibility


class Stages:
    """The compiled stages of a device."""

    def __init__(self, device: Device) -> None:
        self.shadows = Shadows(device)
        self.irradiance = Irradiance(device)
        self.diffuse = Diffuse(device)
        self.published = Published(device)
        self.opposite = Opposite(device)
        self.transmission = Transmission(device)
        self.combine = Combine(device)
        self.blend = Blend(device)
        self.visibility = Visibility(device)
        self.shade = Shade(device)
        self.screen_space = ScreenSpace(device)
        self.bloom = Bloom(device)
        self.post = Post(device)

    def spreading(self, technique: str) -> Diffuse | Published:
        """The stage that blurs light over the atlas."""
        return self.published if technique == "published" else self.diffuse


def draw_frame(frame: Frame, stages: Stages, inputs: Inputs) -> None:
    """Record all of a frame: light the skin, let it spread below, look at it."""
    stages.shadows.draw(frame, inputs.shadow_maps, inputs.light_clips, inputs.head, inputs.shadow_key)
    if inputs.scatters:
        scatter(frame, stages, inputs)
    stages.visibility.draw(frame, inputs.seen, inputs.camera_clips, inputs.head)
    view, picture = inputs.view, inputs.picture
    stages.shade.draw(
        frame,
        inputs.lit,
        view,
        inputs.switches,
        inputs.seen,
        inputs.scattered,
        picture.radiance,
        picture.size,
        inputs.spread.apart.layers if inputs.spread else None,
    )
    radiance = picture.radiance
    if inputs.spread:
        radiance = stages.screen_space.draw(frame, inputs.spread, radiance)
    if inputs.glow:
        radiance = stages.bloom.draw(frame, inputs.glow, radiance, inputs.settings.bloom)
    stages.post.draw(frame, radiance, picture, inputs.settings)


def scatter(frame: Frame, stages: Stages, inputs: Inputs) -> None:
    """Light the atlas and let the light spread over it."""
    levels, spread = inputs.levels, stages.spreading(inputs.settings.technique)
    for layout in inputs.layouts:
        stages.irradiance.draw(frame, layout, inputs.light_switches, levels.views[0], levels.size)
        spread.draw(frame, levels, layout.atlas, inputs.blurred_mm2, inputs.edge, inputs.clear)
        weights = inputs.blurred_mm2, inputs.level_weight
        through = stages.transmission.draw(frame, levels, layout.thin, *weights) if layout.thin else None
        stages.combine.draw(frame, levels, inputs.level_weight, layout.scattered, through)
    if len(inputs.layouts) > 1:
        first, second = inputs.layouts
        stages.blend.draw(frame, first, second, inputs.scattered)
