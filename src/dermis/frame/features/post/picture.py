"""The picture: exposure, tone curve and encoding."""

from __future__ import annotations

from dataclasses import dataclass, field

from dermis.frame.features.post.meter import Meter, exposure_input
from dermis.frame.programs import program
from dermis.gpu import Buffer, Device, MutableBindings, Recorder, Texture, make_texture
from dermis.scene.settings import Settings

_TONES = ("none", "filmic", "neutral")  # numbered as in tone.wgsl


@dataclass(frozen=True, eq=False)
class Picture:
    """Textures of an image: radiance as shaded; exposed, linear; exposed, in sRGB bytes.

    packed : buffers for reading it back, by their number of words
    """

    radiance: Texture
    exposed: Texture
    bytes: Texture
    size: tuple[int, int]
    packed: dict[int, Buffer] = field(default_factory=dict)


def make_picture(device: Device, size: tuple[int, int]) -> Picture:
    """Space for an image of size (width, height)."""
    radiance, exposed = (make_texture(device, size, "rgba32float", name="picture") for _ in range(2))
    return Picture(radiance, exposed, make_texture(device, size, "rgba8uint", name="picture"), size)


def draw(
    graph: Recorder, radiance: Texture, picture: Picture, settings: Settings, meter: Meter | None = None
) -> None:
    """Expose, apply the tone curve and encode: fill the picture's linear and byte images.

    meter : None where the exposure is given
    """
    shader = program(graph.device, "post/post.wgsl")
    exposure, metered = exposure_input(graph.device, settings, meter)
    record = shader.record("Post", exposure=exposure, **encoding_of(settings))
    bound: MutableBindings = {"settings": record, "image": radiance, "metered": metered}
    bound |= {"exposed": picture.exposed, "bytes": picture.bytes}
    graph.compute("post", shader, bound, picture.size)


def encoding_of(settings: Settings) -> dict[str, int]:
    """Members of the shaders' records: tone curve, and whether colours are encoded."""
    return {"tone": _TONES.index(settings.tone), "encoded": int(settings.gamma == "right")}
