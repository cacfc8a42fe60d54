"""The background behind the head."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features.post.meter import Meter, exposure_input
from dermis.frame.features.shading.view import ray_record
from dermis.frame.programs import program
from dermis.gpu import Bindings, Recorder, Texture, UniformRecord
from dermis.scene.settings import Settings

_KINDS = ("gradient", "environment")  # numbered from 1 as in background.wgsl; 0 is a colour


@dataclass(frozen=True, eq=False)
class Backdrop:
    """Space for the picture with what is behind the head.

    panorama : the one that is seen there where it is not that of the reflections
    """

    result: Texture
    panorama: Texture | None = None


def draw(
    graph: Recorder,
    backdrop: Backdrop,
    look: tuple[Bindings, UniformRecord],
    image: Texture,
    meter: Meter | None,
    settings: Settings,
) -> Texture:
    """The picture with what is behind the head, a texture of `backdrop`.

    look : resources and record of the shading
    meter : None where the exposure is given
    """
    (lit, view), into = look, backdrop.result
    shown, (exposure, metered) = settings.background, exposure_input(graph.device, settings, meter)
    shader = program(graph.device, "post/background.wgsl")
    record = shader.record(
        "Behind",
        rays=ray_record(shader, view),
        kind=1 + _KINDS.index(shown) if isinstance(shown, str) else 0,
        colour=(0.0, 0.0, 0.0) if isinstance(shown, str) else shown,
        exposure=exposure,
        blur=settings.background_blur,
    )
    bound = {**lit, "behind": record, "image": image, "metered": metered, "result": into}
    if backdrop.panorama is not None:
        bound["panorama"] = backdrop.panorama
    graph.compute("background", shader, bound, into.size[:2])
    return into
