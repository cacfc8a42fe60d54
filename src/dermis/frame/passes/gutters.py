"""The gutters of a stitched atlas, walked over a person's surface from the edges of charts."""

from __future__ import annotations

from itertools import pairwise

from dermis.frame.atlas_textures import AtlasTextures
from dermis.frame.geometry import HeadResources
from dermis.frame.gutters import Walks
from dermis.frame.passes import each, program
from dermis.gpu import Recorder


def draw(graph: Recorder, atlas: AtlasTextures, walks: Walks, head: HeadResources) -> None:
    """Find where each texel beyond a chart's edge has its light.

    atlas : with lists of its own, see `frame.gutters.with_lists`
    head : at rest
    """
    device, size = graph.device, (("SIZE", atlas.resources["atlas"].size[0]),)
    begun = {"walks": walks.walks, "sides": walks.sides, "gutter": atlas.gutter}
    walk, halve = program(device, "gutter_walk.wgsl", size), program(device, "gutter_halve.wgsl")
    graph.dispatch("gutters", walk, head.resources | begun, each(len(atlas.gutter_texels)))
    listed = [sheet for sheet in (atlas, *atlas.coarser) if sheet.gutter]
    for (finer, coarser), halving in zip(pairwise(listed), walks.halvings, strict=True):
        bound = halving | {"finer": finer.gutter, "coarser": coarser.gutter}
        graph.dispatch("gutters", halve, bound, each(len(coarser.gutter_texels)))
