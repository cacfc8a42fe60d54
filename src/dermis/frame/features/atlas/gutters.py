"""Gutters of a stitched atlas that follow another person: walks over the surface from the edges of charts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.stitched.surface import sides_across
from dermis.frame.features.atlas.textures import ENTRY_BYTES, AtlasTextures
from dermis.frame.features.shape.mesh import HeadResources
from dermis.frame.programs import each, program
from dermis.gpu import Bindings, Buffer, Device, Recorder
from dermis.mesh.mesh import Mesh

Words = NDArray[np.uint32]
_NONE = 0xFFFFFFFF  # across a side


@dataclass(frozen=True, eq=False)
class Walks:
    """What walks begin with, as buffers.

    walks, sides : as gutter_walk.wgsl reads them
    halvings : of the coarser atlases that have gutters, as gutter_halve.wgsl reads them
    """

    walks: Buffer
    sides: Buffer
    halvings: tuple[Bindings, ...]


def make_walks(device: Device, mesh: Mesh, atlas: Atlas, textures: AtlasTextures) -> Walks:
    """What the passes read, of an atlas that has gutters."""
    walks, sides = (device.buffer(words, "STORAGE") for words in (_walks(atlas), _side_words(mesh)))
    sheets = (textures, *textures.coarser)
    return Walks(walks, sides, tuple(_halving(device, *pair) for pair in pairwise(sheets) if pair[1].gutter))


def with_lists(device: Device, textures: AtlasTextures) -> AtlasTextures:
    """The atlas with lists of gutters of its own, none of whose sources is known yet."""

    def listed(sheet: AtlasTextures) -> AtlasTextures:
        words = np.zeros((len(sheet.gutter_texels), ENTRY_BYTES // 4), np.uint32)
        return replace(sheet, gutter=device.buffer(words, "STORAGE")) if len(words) else sheet

    return replace(listed(textures), coarser=tuple(map(listed, textures.coarser)))


def _walks(atlas: Atlas) -> Words:
    """(a, 5) texel, triangle and weights where the walk begins, and the source if it leads nowhere."""
    root = np.full((atlas.size, atlas.size), -1, np.int64)
    root[atlas.beyond[:, 1], atlas.beyond[:, 0]] = np.arange(len(atlas.beyond))
    x, y = atlas.gutter.T.astype(np.uint32)
    of = root[y, x]
    second, third = atlas.root_weight[of].T.astype(np.uint32)
    begun = np.stack([x | (y << 16), atlas.root[of].astype(np.uint32), second | (third << 16)], axis=1)
    return np.concatenate([begun, np.ascontiguousarray(atlas.source).view(np.uint32)], axis=1)


def _side_words(mesh: Mesh) -> Words:
    """(f, 3) what lies across each side, as gutter_walk.wgsl reads it."""
    beside, entry, flipped = sides_across(mesh)
    skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
    word = (beside.astype(np.uint32) << 3) | (entry.astype(np.uint32) << 1) | flipped
    return np.where((beside >= 0) & skin[beside], word, _NONE).astype(np.uint32)


def _halving(device: Device, finer: AtlasTextures, coarser: AtlasTextures) -> Bindings:
    """Which texels of the finer list each texel of the coarser one stands for."""
    wide = int(finer.gutter_texels.max()) + 1

    def square(texels: NDArray[np.integer]) -> NDArray[np.int64]:
        return texels[:, 1].astype(np.int64) * wide + texels[:, 0]

    fine, coarse = square(finer.gutter_texels // 2), square(coarser.gutter_texels)
    order = np.argsort(fine, kind="stable")
    ends = [np.searchsorted(fine[order], coarse, side) for side in ("left", "right")]
    x, y = coarser.gutter_texels.T.astype(np.uint32)
    listed = np.stack([x | (y << 16), *ends], axis=1).astype(np.uint32)
    return {
        "squares": device.buffer(listed, "STORAGE"),
        "members": device.buffer(order.astype(np.uint32), "STORAGE"),
    }


def draw(graph: Recorder, atlas: AtlasTextures, walks: Walks, head: HeadResources) -> None:
    """Find where each texel beyond a chart's edge has its light.

    atlas : with lists of its own, see `frame.gutters.with_lists`
    head : at rest
    """
    device, size = graph.device, (("SIZE", atlas.resources["atlas"].size[0]),)
    assert atlas.gutter is not None
    begun: Bindings = {**head.resources, "walks": walks.walks, "sides": walks.sides, "gutter": atlas.gutter}
    walk, halve = program(device, "atlas/gutter_walk.wgsl", size), program(device, "atlas/gutter_halve.wgsl")
    graph.dispatch("gutters", walk, begun, each(len(atlas.gutter_texels)))
    listed = [sheet for sheet in (atlas, *atlas.coarser) if sheet.gutter]
    for (finer, coarser), halving in zip(pairwise(listed), walks.halvings, strict=True):
        assert finer.gutter is not None and coarser.gutter is not None
        bound = {**halving, "finer": finer.gutter, "coarser": coarser.gutter}
        graph.dispatch("gutters", halve, bound, each(len(coarser.gutter_texels)))
