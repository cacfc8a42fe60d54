"""Light that enters the skin, on the atlas."""

from __future__ import annotations

from typing import Any

from dermis.frame.atlas_layout import AtlasLayout
from dermis.frame.levels import FLOATS
from dermis.frame.lights.records import oblique
from dermis.frame.passes import program
from dermis.gpu import Constants, Recorder


def draw(
    graph: Recorder,
    layout: AtlasLayout,
    constants: Constants,
    into: Any,
    side: int,
    texel: str = FLOATS,
    scale: float = 1.0,
    area: float = 0.0,
) -> None:
    """Irradiance that passes the surface, times albedo^mix, into a texture of the atlas' size.

    constants : pipeline constants of the lights
    texel : the texture's format
    scale : factor of what is stored
    area : standard deviation of what a texel averages of light that is finer [texel]; 0 for its centre alone,
        as where texels beside each other are not beside each other on the surface
    """
    if area:  # the surface goes on beside each texel
        constants = oblique(constants)
    shader = program(graph.device, "irradiance.wgsl", constants, store=texel)
    entering = shader.record("Entering", scale=scale, area=area)
    bound = {**layout.lit, "surfaces": layout.surfaces, "entering": entering, "stored": into}
    graph.compute("irradiance", shader, bound, (side, side))
