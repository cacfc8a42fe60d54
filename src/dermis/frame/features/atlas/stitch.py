"""The gutters of an atlas: texels beyond a chart's edge take the light from where the surface continues."""

from __future__ import annotations

from dermis.frame.features.atlas.textures import ENTRY_BYTES, AtlasTextures
from dermis.frame.programs import TILE, program
from dermis.gpu import Recorder, TextureOrView

_ROW = 1024  # as in gutter.wgsl


def draw(graph: Recorder, stage: str, atlas: AtlasTextures, light: TextureOrView, texel: str) -> None:
    """Fill the gutter of `light` by way of a list, as no texture can be read and written at once.

    texel : its format
    """
    if atlas.gutter is None or atlas.gathered is None:
        return
    device = graph.device
    gather = program(device, "atlas/stitch_gather.wgsl", source=texel)
    place = program(device, "atlas/stitch_place.wgsl", store=texel)
    linear = device.sampler(mag_filter="linear", min_filter="linear")
    size = (_ROW, -(-atlas.gutter.size // (ENTRY_BYTES * _ROW)))
    lists = {"gutter": atlas.gutter, "gathered": atlas.gathered}
    graph.compute(stage, gather, {**lists, "source": light, "linear": linear}, size, TILE)
    graph.compute(stage, place, {**lists, "stored": light}, size, TILE, completes="stored")
