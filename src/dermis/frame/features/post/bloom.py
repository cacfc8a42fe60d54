"""Bloom, light that the lens scatters: ever wider Gaussians of the whole picture, without a threshold."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dermis.frame.programs import program
from dermis.gpu import Bindings, Device, Recorder, Texture, make_texture

_COARSEST = 4  # halvings short of one pixel: the widest Gaussian spans a sixteenth of the picture


@dataclass(frozen=True, eq=False)
class BloomTextures:
    """Textures for a picture's halvings, for the sums on the way back up, and for the result."""

    halved: list[Texture]
    sums: list[Texture]
    result: Texture


def make_bloom(device: Device, size: tuple[int, int]) -> BloomTextures:
    """Space for a picture of size (width, height)."""
    count = max(1, int(math.log2(min(size))) - _COARSEST) if min(size) > 1 else 1
    sides = [(max(1, size[0] >> k), max(1, size[1] >> k)) for k in range(1, count + 1)]
    halved, sums = ([make_texture(device, side, "rgba32float") for side in sides] for _ in range(2))
    return BloomTextures(halved, sums[:-1], make_texture(device, size, "rgba32float"))


def draw(graph: Recorder, glow: BloomTextures, picture: Texture, share: float) -> Texture:
    """The picture with `share` of its light scattered, none of it lost; a texture of `glow`."""
    source = picture
    for halved in glow.halved:
        _step(graph, 0, source, source, halved, 0.0, 0.0)
        source = halved
    for own, total in zip(reversed(glow.halved[:-1]), reversed(glow.sums), strict=True):
        _step(graph, 1, own, source, total, 1.0, 1.0)
        source = total
    _step(graph, 1, picture, source, glow.result, 1.0 - share, share / len(glow.halved))
    return glow.result


def _step(
    graph: Recorder, widen: int, own: Texture, smaller: Texture, into: Texture, *factors: float
) -> None:
    shader = program(graph.device, "post/bloom.wgsl", (("WIDEN", widen),))
    record = shader.record("Bloom", own=factors[0], wider=factors[1])
    bound: Bindings = {"bloom": record, "picture": own, "smaller": smaller, "result": into}
    graph.compute("bloom", shader, bound, into.size[:2])
