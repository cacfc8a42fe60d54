"""One frame, read from top to bottom."""

from __future__ import annotations

from dermis.gpu import Device, Frame
from dermis.rendering.inputs import Inputs
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
        self.visibility = Visibility(device)
        self.shade = Shade(device)
        self.bloom = Bloom(device)
        self.post = Post(device)


def draw_frame(frame: Frame, stages: Stages, inputs: Inputs) -> None:
    """Record all of a frame: light the skin, let it spread below, look at it."""
    head, atlas, lit, levels = inputs.head, inputs.atlas, inputs.lit, inputs.levels
    stages.shadows.draw(frame, inputs.shadow_maps, inputs.light_clips, head, inputs.shadow_key)
    if inputs.scatters:
        stages.irradiance.draw(
            frame, lit, inputs.light_switches, atlas.resources, levels.views[0], levels.size
        )
        stages.diffuse.draw(frame, levels, atlas, inputs.blurred_mm2)
        stages.combine.draw(frame, levels, inputs.level_weight, inputs.scattered)
    stages.visibility.draw(frame, inputs.seen, inputs.camera_clips, head)
    view, picture = inputs.view, inputs.picture
    stages.shade.draw(
        frame, lit, view, inputs.switches, inputs.seen, inputs.scattered, picture.radiance, picture.size
    )
    radiance = picture.radiance
    if inputs.glow:
        radiance = stages.bloom.draw(frame, inputs.glow, radiance, inputs.settings.bloom)
    stages.post.draw(frame, radiance, picture, inputs.settings)
