"""Surface properties at atlas texels, stored so that lighting does not read the mesh and its maps."""

from __future__ import annotations

from dermis.frame.features.atlas.lit_atlas import LitAtlas
from dermis.frame.programs import program
from dermis.gpu import Device, Recorder, Texture, make_texture, mark_scratch

SURFACE_TEXEL_BYTES = 32
"""Size of a texel of the surface texture [bytes]."""


def make_surface_texture(device: Device, atlas_side: int) -> Texture:
    """Allocate the texture of positions, normals, colours and gloss of texels, see packed_surface.wgsl."""
    return mark_scratch(
        device,
        make_texture(
            device, (atlas_side, atlas_side), "rgba32uint", layer_count=2, texture_name="atlas's surface"
        ),
    )


def draw(graph: Recorder, layout: LitAtlas) -> None:
    """Declare the pass that fills the surface texture of an atlas layout."""
    bound = {**layout.bindings, **layout.atlas.resources, "surfaces": layout.surfaces}
    graph.compute(
        "surface", program(graph.device, "surface/surface_texels.wgsl"), bound, layout.surfaces.size[:2]
    )
