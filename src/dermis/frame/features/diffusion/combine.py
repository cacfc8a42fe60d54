"""Pass that computes the weighted sum of the blurred levels, with the weights of the profile's Gaussians."""

from __future__ import annotations

import numpy as np

from dermis.frame.features.diffusion.pyramid import Blur, PyramidLevels
from dermis.frame.programs import FLOAT_TEXEL_FORMAT, TILE_SIDE, program
from dermis.gpu import Bindings, Device, Recorder, Texture, TextureOrView, make_texture
from dermis.optics.gaussians import MAX_GAUSSIANS


def make_blur_sum(device: Device, atlas_side: int) -> Texture:
    """Allocate the texture for the weighted sum of blurred levels, as large as the atlas."""
    return make_texture(
        device, (atlas_side, atlas_side), FLOAT_TEXEL_FORMAT, texture_name="sum of blurred light"
    )


def draw(
    graph: Recorder,
    levels: PyramidLevels,
    blur: Blur,
    summed_light: TextureOrView,
    transmitted_light: Texture | None = None,
    lost_fraction: Texture | None = None,
) -> None:
    """Declare the passes that compute the weighted sum of all blurred levels, from coarse to fine resolution.

    Diffusion is computed as in infinitely thick skin. Thin parts of the head, such as ears, return less light
    and transmit some.

    summed_light : texture for the sum
    transmitted_light : texture of the light transmitted by thin parts, which is added to the sum; None if no
        light is transmitted
    lost_fraction : texture of the fraction of the blurred light that is lost where the head is thin; None if
        the head has no thin parts
    """
    device, halvings = graph.device, blur.halvings[1 : len(blur.weight) + 1]
    coarsest = max(halvings)
    # Transmitted light without finer detail is added at half the resolution.
    halve = transmitted_light is not None and coarsest > 0 and 2 * transmitted_light.size[0] <= levels.size
    for mip in range(coarsest, -1, -1):
        added = transmitted_light if mip == int(halve) else None
        constants = (
            ("COARSER", mip < coarsest),
            ("TRANSMITTED", added is not None),
            ("THIN", lost_fraction is not None),
        )
        texel_format = levels.texel_format
        shader = program(
            device,
            "diffusion/combine.wgsl",
            constants,
            texel_format,
            texel_format if mip else FLOAT_TEXEL_FORMAT,
        )
        first, count = halvings.index(mip), halvings.count(mip)
        weight = np.zeros((MAX_GAUSSIANS, 4), np.float32)
        weight[:count, :3] = blur.weight[first : first + count]
        weight[0, 3] = 1.0
        layers = {"first": 1 + first - levels.first[mip], "count": count, "weight": weight}
        if mip:
            scales = {"scale": 1.0, "transmitted_scale": blur.scale}
        else:
            scales = {"scale": 1.0 / blur.scale, "transmitted_scale": 1.0}
        bindings: Bindings = {
            "weights": shader.make_record("Weights", **layers, **scales),
            "levels": levels.stacks[mip],
            "source": levels.scratch_view(mip + 1) if mip < coarsest else levels.layer(0),
            "transmitted": placeholder_light(device) if added is None else added,
            "lost": placeholder_light(device) if lost_fraction is None else lost_fraction,
            "linear": device.sampler(mag_filter="linear", min_filter="linear"),
            "stored": levels.scratch_view(mip) if mip else summed_light,
        }
        graph.compute("combine", shader, bindings, (levels.size >> mip,) * 2, TILE_SIDE)


def placeholder_light(device: Device) -> Texture:
    """Return a 1 x 1 placeholder for a texture of light that the shader does not read."""
    return device.cached(
        "no light", lambda: make_texture(device, (1, 1), "rgba32float", content_source="map")
    )
