"""Pass from radiance to the displayed picture: exposure, tone curve and sRGB encoding."""

from __future__ import annotations

from dataclasses import dataclass, field

from dermis.frame.features.post.meter import Meter, exposure_inputs
from dermis.frame.programs import program
from dermis.gpu import Buffer, Device, MutableBindings, Recorder, Texture, make_texture
from dermis.scene.settings import Settings

_TONE_CURVES = ("none", "filmic", "neutral")  # numbered as in tone.wgsl


@dataclass(frozen=True, eq=False)
class Picture:
    """Textures of a picture.

    radiance : radiance of each pixel, with its coverage by the head as alpha
    exposed : linear light after exposure
    bytes : sRGB bytes
    size : (width, height) [pixel]
    packed : buffers into which the picture is packed for readback; the key is the number of 4-byte words
    """

    radiance: Texture
    exposed: Texture
    bytes: Texture
    size: tuple[int, int]
    packed: dict[int, Buffer] = field(default_factory=dict)


def make_picture(device: Device, picture_size: tuple[int, int]) -> Picture:
    """Allocate the textures of a picture of size (width, height)."""
    radiance, exposed = (
        make_texture(device, picture_size, "rgba32float", texture_name="picture") for _ in range(2)
    )
    return Picture(
        radiance,
        exposed,
        make_texture(device, picture_size, "rgba8uint", texture_name="picture"),
        picture_size,
    )


def draw(
    graph: Recorder, radiance: Texture, picture: Picture, settings: Settings, meter: Meter | None = None
) -> None:
    """Declare the pass that fills `exposed` and `bytes` of a picture: exposure, tone curve and encoding.

    meter : exposure meter, None for a fixed exposure
    """
    shader = program(graph.device, "post/post.wgsl")
    exposure, metered = exposure_inputs(graph.device, settings, meter)
    record = shader.make_record("Post", exposure=exposure, **encoding_members(settings))
    bindings: MutableBindings = {"settings": record, "image": radiance, "metered": metered}
    bindings |= {"exposed": picture.exposed, "bytes": picture.bytes}
    graph.compute("post", shader, bindings, picture.size)


def encoding_members(settings: Settings) -> dict[str, int]:
    """Return the members of a uniform record that select the tone curve and the sRGB encoding."""
    return {"tone": _TONE_CURVES.index(settings.tone), "encoded": int(settings.gamma == "right")}
