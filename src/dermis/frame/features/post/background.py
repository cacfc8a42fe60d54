"""Pass that adds the background behind the head."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features.post.meter import Meter, exposure_inputs
from dermis.frame.features.shading.view import ray_record
from dermis.frame.programs import program
from dermis.gpu import Bindings, Recorder, Texture, UniformRecord
from dermis.scene.settings import Settings

_DRAWN_BACKGROUNDS = ("gradient", "environment")  # numbered from 1 as in background.wgsl; 0 is a colour


@dataclass(frozen=True, eq=False)
class Backdrop:
    """Textures of the background.

    result : texture of the picture with its background
    panorama : unfiltered panorama for a sharp background, None to show the prefiltered panorama that lights
        the skin
    """

    result: Texture
    panorama: Texture | None = None


def draw(
    graph: Recorder,
    backdrop: Backdrop,
    shading_inputs: tuple[Bindings, UniformRecord],
    foreground: Texture,
    meter: Meter | None,
    settings: Settings,
) -> Texture:
    """Declare the pass that adds the background to a picture; return `backdrop.result`.

    shading_inputs : resources of the lighting, and the uniform record of the shading pass
    foreground : texture of the picture without background
    meter : exposure meter, None for a fixed exposure
    """
    (lighting, view), background = shading_inputs, settings.background
    exposure, metered = exposure_inputs(graph.device, settings, meter)
    shader = program(graph.device, "post/background.wgsl")
    record = shader.make_record(
        "Background",
        rays=ray_record(shader, view),
        kind=1 + _DRAWN_BACKGROUNDS.index(background) if isinstance(background, str) else 0,
        colour=(0.0, 0.0, 0.0) if isinstance(background, str) else background,
        exposure=exposure,
        blur=settings.background_blur,
    )
    images = {"image": foreground, "result": backdrop.result}
    bindings = {**lighting, "background": record, "metered": metered, **images}
    if backdrop.panorama is not None:
        bindings["panorama"] = backdrop.panorama
    graph.compute("background", shader, bindings, backdrop.result.size[:2])
    return backdrop.result
