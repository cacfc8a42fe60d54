"""Space for what makes a picture of radiance: meter, background, bloom, the picture; and outputs."""

from __future__ import annotations

from typing import Any

from dermis.base.errors import refuse
from dermis.frame import surroundings
from dermis.frame.asked import Asked
from dermis.frame.atlas_layout import AtlasLayout
from dermis.frame.output_resources import output_resources
from dermis.frame.passes.background import Backdrop
from dermis.frame.passes.bloom import make_glow
from dermis.frame.passes.meter import make_meter
from dermis.frame.passes.post import make_picture
from dermis.frame.shape import ShapeTables
from dermis.gpu import Device, Memo, make_texture


def picture_resources(
    memo: Memo, device: Device, asked: Asked, layouts: tuple[AtlasLayout, ...], tables: ShapeTables
) -> dict[str, Any]:
    """By their names among the frame's resources.

    Raises DermisError for surroundings to be seen where there are none.
    """
    settings, keep = asked.settings, memo.keep
    return {
        "picture": keep(make_picture, device, settings.size),
        "meter": keep(make_meter, device) if settings.exposure == "auto" else None,
        "backdrop": _backdrop(memo, device, asked),
        "glow": keep(make_glow, device, settings.size) if settings.bloom else None,
        "outputs": output_resources(memo, device, asked, layouts, tables),
    }


def _backdrop(memo: Memo, device: Device, asked: Asked) -> Backdrop | None:
    """Space for what is behind the head, and the panorama as it is where that is to be sharp."""
    settings, around = asked.settings, asked.environment
    if settings.background == "none":
        return None
    result = memo.keep(_backed, device, settings.size)
    if settings.background != "environment":
        return Backdrop(result)
    if around is None:
        remedy = "Add one (--env), or choose another"
        refuse("background environment", "an environment", "there is none", remedy)
    sharp = settings.background_blur == 0.0
    return Backdrop(result, memo.keep(surroundings.sharp, device, around.name) if sharp else None)


def _backed(device: Device, size: tuple[int, int]) -> Any:
    return make_texture(device, size, "rgba32float")
