"""The surface at each texel of an atlas, so that lighting it reads neither the mesh nor its maps."""

from __future__ import annotations

from dermis.frame.features.atlas.lit import LitAtlas
from dermis.frame.programs import program
from dermis.gpu import Device, Recorder, Texture, make_texture, scratch

SURFACE_BYTES = 32
"""Bytes of a texel."""


def make_surfaces(device: Device, side: int) -> Texture:
    """A texture for positions, normals, colours and gloss: two layers, as packed_surface.wgsl packs them."""
    return mark_scratch(device, make_texture(device, (side, side), "rgba32uint", layers=2, name="atlas's surface"))


def draw(graph: Recorder, layout: LitAtlas) -> None:
    """Fill the layout's surfaces."""
    bound = {**layout.lit, **layout.atlas.resources, "surfaces": layout.surfaces}
    graph.compute(
        "surface", program(graph.device, "surface/surface_texels.wgsl"), bound, layout.surfaces.size[:2]
    )
