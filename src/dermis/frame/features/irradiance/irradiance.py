"""Irradiance over the atlas, and parameters of a correction for light that varies within a texel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.atlas.lit_atlas import LitAtlas
from dermis.frame.lights.records import with_oblique_incidence_constant
from dermis.frame.programs import FLOAT_TEXEL_FORMAT, program
from dermis.gpu import Constants, Recorder, TextureOrView

MAX_FINE_GAUSSIANS = 8
"""Largest number of Gaussians that are corrected for light that varies within a texel: the narrowest ones."""
LIGHT_FILTER_SIGMA_TEXELS = 0.5
"""Standard deviation of the filter that keeps light on the atlas from aliasing [texels]."""


def subtexel_light_constants() -> dict[str, float]:
    """Return the named values that the shader preprocessor inserts at `//#fill` in subtexel_light.wgsl."""
    return {"fine_levels": MAX_FINE_GAUSSIANS}


def subtexel_light_members(
    variance_mm2: NDArray[np.float64], weight: NDArray[np.float64], unblurred_mm2: float
) -> dict[str, float | NDArray[np.floating]]:
    """Return the members of the shader struct `Fine`.

    From these, shaders compute how light varies within a texel, which the atlas cannot resolve.

    variance_mm2 : (k,) variances of the Gaussians that blur light over the atlas [mm^2]
    weight : (k, 3) weights of these Gaussians for red, green and blue [-]
    unblurred_mm2 : variance of the narrowest Gaussian of the profile [mm^2]. This Gaussian is too narrow
        for a blur over the atlas; its light is evaluated at each pixel instead
    """
    count = min(len(variance_mm2), MAX_FINE_GAUSSIANS)
    level = np.zeros((MAX_FINE_GAUSSIANS, 4), np.float32)
    level[:count, :3], level[:count, 3] = weight[:count], variance_mm2[:count]
    return {
        "count": count,
        "texel_variance": LIGHT_FILTER_SIGMA_TEXELS**2,
        "unblurred_mm2": unblurred_mm2,
        "level": level,
    }


def draw(
    graph: Recorder,
    layout: LitAtlas,
    constants: Constants,
    irradiance_texture: TextureOrView,
    atlas_side: int,
    texel_format: str = FLOAT_TEXEL_FORMAT,
    irradiance_scale: float = 1.0,
    filter_sigma_texels: float = 0.0,
) -> None:
    """Declare the pass that stores, at each texel, the irradiance times the skin colour.

    The skin colour is the part of the albedo that is applied before the light scatters.

    layout : atlas with the resources that light its texels
    constants : pipeline constants of the lights
    irradiance_texture : texture of `atlas_side` x `atlas_side` texels to write to
    atlas_side : side of the atlas [texels]
    texel_format : format of the texture
    irradiance_scale : factor by which irradiance is multiplied before it is stored
    filter_sigma_texels : standard deviation of the filter for light that varies within a texel [texels]; 0 to
        sample light only at texel centres, which is necessary if adjacent texels can be far apart on the
        surface
    """
    if filter_sigma_texels:  # neighbouring texels are neighbours on the surface
        constants = with_oblique_incidence_constant(constants)
    shader = program(graph.device, "irradiance/irradiance.wgsl", constants, store_format=texel_format)
    entering = shader.make_record("Entering", scale=irradiance_scale, area=filter_sigma_texels)
    bound = {
        **layout.bindings,
        "surfaces": layout.surfaces,
        "entering": entering,
        "stored": irradiance_texture,
    }
    graph.compute("irradiance", shader, bound, (atlas_side, atlas_side))
