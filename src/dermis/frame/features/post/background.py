"""Pass that adds the background behind the head."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dermis.base.arrays import Floats
from dermis.frame.features.post.meter import Meter, exposure_inputs
from dermis.frame.features.shading.view import ray_record
from dermis.frame.programs import program
from dermis.gpu import Bindings, Recorder, Texture, UniformRecord
from dermis.scene.settings import Settings

_BACKDROP_MIDDLE = (0.5, 0.42)
_BACKDROP_BRIGHT = (0.2, 0.207, 0.22)  # a little cooler than skin
_BACKDROP_DARK = (0.026, 0.027, 0.029)
_BACKDROP_WIDTH = 0.45
_DRAWN_BACKGROUNDS = ("gradient", "environment")  # numbered from 1 as in background.wgsl; 0 is a colour


def shader_constants() -> dict[str, float]:
    """Return the named values of the studio backdrop that the shader preprocessor inserts at `//#fill`."""
    colours = {"bright": _BACKDROP_BRIGHT, "dark": _BACKDROP_DARK}
    channels = {
        f"backdrop_{name}_{channel}": value
        for name, colour in colours.items()
        for channel, value in zip(("red", "green", "blue"), colour, strict=True)
    }
    middle = {"backdrop_middle_x": _BACKDROP_MIDDLE[0], "backdrop_middle_y": _BACKDROP_MIDDLE[1]}
    return {**middle, **channels, "backdrop_width": _BACKDROP_WIDTH}


def studio_backdrop(picture_size: tuple[int, int]) -> Floats:
    """Return the studio backdrop (h, w, 3) in linear Rec. 709, as the shader draws it.

    picture_size : width and height [pixel]
    """
    width, height = picture_size
    x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
    distance_x = (x - _BACKDROP_MIDDLE[0] * width) / (_BACKDROP_WIDTH * max(picture_size))
    distance_y = (y - _BACKDROP_MIDDLE[1] * height) / (_BACKDROP_WIDTH * max(picture_size))
    weight = np.exp(-0.5 * (distance_x[None, :] ** 2 + distance_y[:, None] ** 2))[..., None]
    dark, bright = np.array(_BACKDROP_DARK), np.array(_BACKDROP_BRIGHT)
    return np.asarray(dark + weight * (bright - dark), np.float32)


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
