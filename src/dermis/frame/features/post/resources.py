"""Resources of post-processing, and the passes that turn radiance into the displayed picture."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.base.errors import refuse
from dermis.frame.features.post import background, bloom, meter, picture
from dermis.frame.features.post.background import Backdrop
from dermis.frame.features.post.bloom import BloomTextures, make_bloom
from dermis.frame.features.post.meter import Meter, make_meter
from dermis.frame.features.post.picture import Picture, make_picture
from dermis.frame.lights.environment import unfiltered_panorama
from dermis.frame.request import FrameRequest
from dermis.gpu import Bindings, Constants, Device, Memo, Recorder, Texture, UniformRecord, make_texture
from dermis.scene.settings import METERED_EXPOSURES, Settings


@dataclass(frozen=True, eq=False)
class Resources:
    """Resources of post-processing.

    meter : exposure meter, None for a fixed exposure
    backdrop : textures of the background, None for a black or transparent background
    bloom : textures of the bloom, None if there is no bloom
    """

    picture: Picture
    meter: Meter | None
    backdrop: Backdrop | None
    bloom: BloomTextures | None


def make_resources(memo: Memo, device: Device, request: FrameRequest) -> Resources:
    """Return the resources of the requested post-processing.

    Raises DermisError if the background shows the environment, but the scene has no environment.
    """
    settings, cached = request.settings, memo.get
    return Resources(
        picture=cached(make_picture, device, settings.size),
        meter=cached(make_meter, device) if settings.exposure in METERED_EXPOSURES else None,
        backdrop=_make_backdrop(memo, device, request),
        bloom=cached(make_bloom, device, settings.size) if settings.bloom else None,
    )


def draw(
    graph: Recorder,
    resources: Resources,
    settings: Settings,
    radiance: Texture,
    lighting_bindings: Bindings,
    shade_record: UniformRecord,
    light_constants: Constants,
    visibility_buffer: Texture,
) -> None:
    """Declare the passes from radiance to the picture: meter, background, bloom, tone curve and encoding.

    lighting_bindings : resources of the lighting
    shade_record : uniform record of the shading pass
    light_constants : pipeline constants of the lights
    visibility_buffer : texture with the index of the triangle that covers each sample
    """
    if resources.meter:
        shading = lighting_bindings, shade_record, light_constants
        meter.draw(graph, resources.meter, shading, visibility_buffer, radiance, settings.exposure == "skin")
    if resources.backdrop:
        backdrop, exposure = resources.backdrop, resources.meter
        radiance = background.draw(
            graph, backdrop, (lighting_bindings, shade_record), radiance, exposure, settings
        )
    if resources.bloom:
        radiance = bloom.draw(graph, resources.bloom, radiance, settings.bloom)
    picture.draw(graph, radiance, resources.picture, settings, resources.meter)


def _make_backdrop(memo: Memo, device: Device, request: FrameRequest) -> Backdrop | None:
    """Return the textures of the background, None for a black or transparent background.

    The unfiltered panorama is only loaded for a sharp background.
    """
    settings, environment = request.settings, request.environment
    if settings.background == "none":
        return None
    result = memo.get(make_texture, device, settings.size, "rgba32float", caller_name="background")
    if settings.background != "environment":
        return Backdrop(result)
    if environment is None:
        advice = "Add one (--env), or choose another"
        refuse("background environment", "an environment", "there is none", advice)
    sharp = settings.background_blur == 0.0
    return Backdrop(result, memo.get(unfiltered_panorama, device, environment.name) if sharp else None)
