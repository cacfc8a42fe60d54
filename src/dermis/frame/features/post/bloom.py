"""Bloom, the light that a lens scatters: a sum of Gaussian blurs of the picture, without a threshold."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dermis.frame.programs import program
from dermis.gpu import Bindings, Device, Recorder, Texture, make_texture

_OMITTED_HALVING_COUNT = 4  # omitted halvings: the widest Gaussian spans a sixteenth of the picture


@dataclass(frozen=True, eq=False)
class BloomTextures:
    """Textures of the bloom.

    halved : picture at a half, a quarter, ... of its resolution
    sums : for each of these resolutions but the coarsest, the sum of the picture at this resolution and at
        all coarser resolutions
    result : picture with bloom
    """

    halved: list[Texture]
    sums: list[Texture]
    result: Texture


def make_bloom(device: Device, picture_size: tuple[int, int]) -> BloomTextures:
    """Allocate the textures of the bloom for a picture of size (width, height)."""
    count = max(1, int(math.log2(min(picture_size))) - _OMITTED_HALVING_COUNT) if min(picture_size) > 1 else 1
    sides = [(max(1, picture_size[0] >> k), max(1, picture_size[1] >> k)) for k in range(1, count + 1)]
    halved, sums = ([make_texture(device, side, "rgba32float") for side in sides] for _ in range(2))
    return BloomTextures(halved, sums[:-1], make_texture(device, picture_size, "rgba32float"))


def draw(graph: Recorder, textures: BloomTextures, picture: Texture, scattered_fraction: float) -> Texture:
    """Declare the passes that spread a fraction of the light over the picture; return `textures.result`.

    The total light is unchanged.

    scattered_fraction : fraction of the light that the lens scatters [-]
    """
    source = picture
    for halved in textures.halved:
        _draw_bloom_step(graph, 0, source, source, halved, 0.0, 0.0)
        source = halved
    for halved, total in zip(reversed(textures.halved[:-1]), reversed(textures.sums), strict=True):
        _draw_bloom_step(graph, 1, halved, source, total, 1.0, 1.0)
        source = total
    weight = scattered_fraction / len(textures.halved)
    _draw_bloom_step(graph, 1, picture, source, textures.result, 1.0 - scattered_fraction, weight)
    return textures.result


def _draw_bloom_step(
    graph: Recorder,
    widening_factor: int,
    picture: Texture,
    coarser_sum: Texture,
    result_texture: Texture,
    *factors: float,
) -> None:
    shader = program(graph.device, "post/bloom.wgsl", (("WIDEN", widening_factor),))
    record = shader.make_record("Bloom", own=factors[0], wider=factors[1])
    bindings: Bindings = {
        "bloom": record,
        "picture": picture,
        "smaller": coarser_sum,
        "result": result_texture,
    }
    graph.compute("bloom", shader, bindings, result_texture.size[:2])
