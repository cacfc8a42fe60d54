"""Light that enters the skin on the atlas, and the levels that show light finer than its texels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.atlas.lit import LitAtlas
from dermis.frame.lights.records import oblique
from dermis.frame.programs import FLOATS, program
from dermis.gpu import Constants, Recorder, TextureOrView

FINE_LEVELS = 8
"""Narrowest levels that are made whole in the picture; wider ones, texels hold as they are."""
TEXEL_AREA = 0.5
"""Standard deviation of what a texel averages [texel]: little is left to beat with their grid."""


def fine_numbers() -> dict[str, float]:
    """Numbers that fine_light.wgsl fills in."""
    return {"fine_levels": FINE_LEVELS}


def fine_levels(
    variance_mm2: NDArray[np.float64], weight: NDArray[np.float64], relit_mm2: float
) -> dict[str, float | NDArray[np.floating]]:
    """Members of the shader's struct Fine.

    variance_mm2, weight : (k,) and (k, 3) of the blurred levels
    relit_mm2 : variance of the level that is not blurred
    """
    count = min(len(variance_mm2), FINE_LEVELS)
    level = np.zeros((FINE_LEVELS, 4), np.float32)
    level[:count, :3], level[:count, 3] = weight[:count], variance_mm2[:count]
    return {"count": count, "texel_variance": TEXEL_AREA**2, "relit_mm2": relit_mm2, "level": level}


def draw(
    graph: Recorder,
    layout: LitAtlas,
    constants: Constants,
    into: TextureOrView,
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
    shader = program(graph.device, "irradiance/irradiance.wgsl", constants, store=texel)
    entering = shader.record("Entering", scale=scale, area=area)
    bound = {**layout.lit, "surfaces": layout.surfaces, "entering": entering, "stored": into}
    graph.compute("irradiance", shader, bound, (side, side))
