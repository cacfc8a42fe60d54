"""Resources of post-processing, and its passes in order."""

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
from dermis.scene.settings import Settings


@dataclass(frozen=True, eq=False)
class Resources:
    """Space for what makes a picture of radiance.

    meter : of the exposure, None where it is given
    backdrop : what is behind the head, None for nothing
    glow : of the bloom, None without one
    """

    picture: Picture
    meter: Meter | None
    backdrop: Backdrop | None
    glow: BloomTextures | None


def make(memo: Memo, device: Device, request: FrameRequest) -> Resources:
    """Return the resources of the requested post-processing.

    Raises DermisError for a background that shows an environment where there is none.
    """
    settings, cached = request.settings, memo.get
    return Resources(
        picture=cached(make_picture, device, settings.size),
        meter=cached(make_meter, device) if settings.exposure == "auto" else None,
        backdrop=_backdrop(memo, device, request),
        glow=cached(make_bloom, device, settings.size) if settings.bloom else None,
    )


def draw(
    graph: Recorder,
    made: Resources,
    settings: Settings,
    radiance: Texture,
    lit: Bindings,
    view: UniformRecord,
    light_constants: Constants,
    visibility: Texture,
) -> None:
    """Declare the passes from radiance to the picture.

    lit, view, light_constants : resources and record of the shading, and pipeline constants of the lights
    visibility : texture of the triangles that samples see
    """
    if made.meter:
        meter.draw(graph, made.meter, (lit, view, light_constants), visibility, radiance)
    if made.backdrop:
        radiance = background.draw(graph, made.backdrop, (lit, view), radiance, made.meter, settings)
    if made.glow:
        radiance = bloom.draw(graph, made.glow, radiance, settings.bloom)
    picture.draw(graph, radiance, made.picture, settings, made.meter)


def _backdrop(memo: Memo, device: Device, request: FrameRequest) -> Backdrop | None:
    """Return space for what is behind the head, with the sharp panorama where that is shown."""
    settings, around = request.settings, request.environment
    if settings.background == "none":
        return None
    result = memo.get(_result, device, settings.size)
    if settings.background != "environment":
        return Backdrop(result)
    if around is None:
        advice = "Add one (--env), or choose another"
        refuse("background environment", "an environment", "there is none", advice)
    sharp = settings.background_blur == 0.0
    return Backdrop(result, memo.get(unfiltered_panorama, device, around.name) if sharp else None)


def _result(device: Device, size: tuple[int, int]) -> Texture:
    return make_texture(device, size, "rgba32float")
