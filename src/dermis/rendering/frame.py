"""One frame, read from top to bottom."""

from __future__ import annotations

from dermis.gpu import Device, Frame
from dermis.rendering.inputs import Inputs
from dermis.rendering.stages.blend import Blend
from dermis.rendering.stages.bloom import Bloom
from dermis.rendering.stages.combine import Combine
from dermis.rendering.stages.diffuse import Diffuse
from dermis.rendering.stages.irradiance import Irradiance
from dermis.rendering.stages.post import Post
from dermis.rendering.stages.shade import Shade
from dermis.rendering.stages.shadows import Shadows
from dermis.rendering.stages.visibility import Visibility


class Stages:
    """The compiled stages of a device."""

    def __init__(self, device: Device) -> None:
        self.shadows = Shadows(device)
        self.irradiance = Irradiance(device)
        self.diffuse = Diffuse(device)
        self.combine = Combine(device)
        self.blend = Blend(device)
        self.visibility = Visibility(device)
        self.shade = Shade(device)
        self.bloom = Bloom(device)
        self.post = Post(device)


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
    )
    radiance = picture.radiance
    if inputs.glow:
        radiance = stages.bloom.draw(frame, inputs.glow, radiance, inputs.settings.bloom)
    stages.post.draw(frame, radiance, picture, inputs.settings)


def scatter(frame: Frame, stages: Stages, inputs: Inputs) -> None:
    """Light the atlas and let the light spread over it."""
    levels = inputs.levels
    for layout in inputs.layouts:
        stages.irradiance.draw(frame, layout, inputs.light_switches, levels.views[0], levels.size)
        stages.diffuse.draw(frame, levels, layout.atlas, inputs.blurred_mm2, inputs.edge, inputs.clear)
        stages.combine.draw(frame, levels, inputs.level_weight, layout.scattered)
    if len(inputs.layouts) > 1:
        first, second = inputs.layouts
        stages.blend.draw(frame, first, second, inputs.scattered)
