"""The weighted sum of the blurred levels."""

from __future__ import annotations

import numpy as np

from dermis.frame.features.diffusion.pyramid import Blur, Levels
from dermis.frame.programs import FLOATS, TILE, program
from dermis.gpu import Bindings, ComputeProgram, Device, Recorder, Texture, TextureOrView, make_texture
from dermis.optics.gaussians import MOST_GAUSSIANS


def make_sum(device: Device, side: int) -> Texture:
    """Space for the sum."""
    return make_texture(device, (side, side), FLOATS, name="sum of blurred light")


def draw(
    graph: Recorder,
    levels: Levels,
    blur: Blur,
    into: TextureOrView,
    transmitted: Texture | None = None,
    lost: Texture | None = None,
) -> None:
    """Sum the blurred layers, all but the first, from coarse resolution to fine.

    transmitted : texture of the light through thin parts, None without any
    lost : texture of the share of the blurred light that thin parts do not return, None for none
    """
    device, blurred = graph.device, blur.halvings[1 : len(blur.weight) + 1]
    coarsest = max(blurred)
    for mip in range(coarsest, -1, -1):
        through = transmitted if mip == _finest_for(transmitted, levels.size, coarsest) else None
        there = through is not None, lost is not None
        shader = _program(device, levels.texel, mip > 0, mip < coarsest, *there)
        first, count = blurred.index(mip), blurred.count(mip)
        padded = np.zeros((MOST_GAUSSIANS, 4), np.float32)
        padded[:count, :3] = blur.weight[first : first + count]
        padded[0, 3] = 1.0
        layers = {"first": 1 + first - levels.first[mip], "count": count, "weight": padded}
        scales = {"scale": 1.0, "through": blur.scale} if mip else {"scale": 1.0 / blur.scale, "through": 1.0}
        bound: Bindings = {
            "weights": shader.record("Weights", **layers, **scales),
            "levels": levels.stacks[mip],
            "source": levels.spare(mip + 1) if mip < coarsest else levels.layer(0),
            "transmitted": nothing(device) if through is None else through,
            "lost": nothing(device) if lost is None else lost,
            "linear": device.sampler(mag_filter="linear", min_filter="linear"),
            "stored": levels.spare(mip) if mip else into,
        }
        graph.compute("combine", shader, bound, (levels.size >> mip,) * 2, TILE)


def nothing(device: Device) -> Texture:
    """Placeholder for transmitted light where there is none."""
    return device.shared("nothing", lambda: make_texture(device, (1, 1), "rgba32float", use="map"))


def _program(
    device: Device, texel: str, between: bool, coarser: bool, transmitted: bool, thin: bool
) -> ComputeProgram:
    """The pass into the texture between passes, or into the sum of 32-bit floats."""
    constants = (("COARSER", coarser), ("TRANSMITTED", transmitted), ("THIN", thin))
    return program(device, "diffusion/combine.wgsl", constants, texel, texel if between else FLOATS)


def _finest_for(transmitted: Texture | None, size: int, coarsest: int) -> int:
    """Halvings of the resolution at which transmitted light is added: 1 if it has no finer detail, else 0."""
    return int(transmitted is not None and coarsest > 0 and 2 * transmitted.size[0] <= size)
