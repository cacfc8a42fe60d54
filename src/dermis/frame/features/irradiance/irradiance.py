"""Irradiance on the atlas, and the parameters of light that varies within a texel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.atlas.lit_atlas import LitAtlas
from dermis.frame.lights.records import oblique_constants
from dermis.frame.programs import FLOAT_FORMAT, program
from dermis.gpu import Constants, Recorder, TextureOrView

FINE_LEVELS = 8
"""Largest number of Gaussians, narrowest first, whose light is corrected within texels in the picture."""
TEXEL_FILTER_SIGMA = 0.5
"""Standard deviation of the filter that keeps light on the atlas from aliasing [texels]."""


def fine_light_constants() -> dict[str, float]:
    """Return the values that `//#fill` lines insert in fine_light.wgsl, by name."""
    return {"fine_levels": FINE_LEVELS}


def fine_light_members(
    variance_mm2: NDArray[np.float64], weight: NDArray[np.float64], relit_mm2: float
) -> dict[str, float | NDArray[np.floating]]:
    """Return the members of the shader struct `Fine`, which corrects light that varies within a texel.

    variance_mm2, weight : (k,) variances [mm2] and (k, 3) weights [-] of the Gaussians that blur
    relit_mm2 : variance of the Gaussian that is relit in the picture instead of blurred [mm2]
    """
    count = min(len(variance_mm2), FINE_LEVELS)
    level = np.zeros((FINE_LEVELS, 4), np.float32)
    level[:count, :3], level[:count, 3] = weight[:count], variance_mm2[:count]
    return {"count": count, "texel_variance": TEXEL_FILTER_SIGMA**2, "relit_mm2": relit_mm2, "level": level}


def draw(
    graph: Recorder,
    layout: LitAtlas,
    constants: Constants,
    target: TextureOrView,
    side: int,
    texel: str = FLOAT_FORMAT,
    scale: float = 1.0,
    filter_sigma: float = 0.0,
) -> None:
    """Declare the pass that stores the irradiance at each texel, times the skin colour before scattering.

    layout : atlas with the resources that light its texels
    constants : pipeline constants of the lights
    target : texture of `side` x `side` texels to write to
    side : side of the atlas [texels]
    texel : format of the texture
    scale : factor from irradiance to the texels of `target`
    filter_sigma : standard deviation of the filter of light finer than texels [texels]; 0 samples texel
        centres, for textures whose adjacent texels are not adjacent on the surface
    """
    if filter_sigma:  # neighbouring texels are neighbours on the surface
        constants = oblique_constants(constants)
    shader = program(graph.device, "irradiance/irradiance.wgsl", constants, store=texel)
    entering = shader.record("Entering", scale=scale, area=filter_sigma)
    bound = {**layout.bindings, "surfaces": layout.surfaces, "entering": entering, "stored": target}
    graph.compute("irradiance", shader, bound, (side, side))
