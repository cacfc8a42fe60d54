"""The gutters of a stitched atlas, walked over a person's surface from the edges of charts."""

from __future__ import annotations

from dermis.atlas.atlas import Atlas
from dermis.frame.atlas_textures import ENTRY_BYTES, AtlasTextures
from dermis.frame.geometry import HeadResources
from dermis.frame.gutters import Walks, make_walks
from dermis.frame.passes import each, program
from dermis.gpu import Device, Frame, Recorder
from dermis.mesh.mesh import Mesh


def walked(
    device: Device, mesh: Mesh, atlas: Atlas, textures: AtlasTextures, head: HeadResources
) -> AtlasTextures:
    """The atlas with gutters that continue as a person's surface at rest does."""
    walks = make_walks(device, mesh, atlas, textures)
    if walks is None:
        return textures
    frame = Frame(device, timed=False)
    draw(frame, head, walks)
    frame.submit()
    return walks.atlas


def draw(graph: Recorder, head: HeadResources, walks: Walks) -> None:
    """Find where each texel beyond a chart's edge has its light."""
    device, gutter = graph.device, walks.walked["gutter"]
    bound = {**head.resources, **walks.walked}
    size = (("SIZE", walks.atlas.resources["atlas"].size[0]),)
    walk = program(device, "gutter_walk.wgsl", size)
    graph.dispatch("gutters", walk, bound, each(gutter.size // ENTRY_BYTES))
    halve = program(device, "gutter_halve.wgsl")
    for one in walks.halved:
        graph.dispatch("gutters", halve, one, each(one["coarser"].size // ENTRY_BYTES))
