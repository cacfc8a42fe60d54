"""Gutters of a stitched atlas: texels beside a chart that copy light from the surface across the seam.

The position from which a gutter texel copies is called its source. It is found by tracing a path over the
surface of each person at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.stitched.surface import side_neighbours
from dermis.frame.features.atlas.textures import GUTTER_ENTRY_BYTES, AtlasTextures
from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.frame.features.shape.shape import run_bounds
from dermis.frame.programs import program, workgroup_grid
from dermis.gpu import Bindings, Buffer, Device, Recorder
from dermis.mesh.mesh import Mesh

Words = NDArray[np.uint32]
_NO_NEIGHBOUR_WORD = 0xFFFFFFFF  # word of a triangle edge without skin across it


@dataclass(frozen=True, eq=False)
class GutterTracing:
    """Constant inputs of the passes that find the position from which each gutter texel copies light.

    For each gutter texel, the passes trace a path over the surface, from the edge of its chart across the
    seam. The position where the path ends is the source of the texel.

    starts : buffer of the point at which each path starts, for gutter_trace.wgsl
    sides : buffer of the neighbours of each triangle across its three edges, for gutter_trace.wgsl
    halvings : for each coarser resolution of the atlas, a dictionary from names in gutter_halve.wgsl to
        buffers. The buffers list the coarser gutter texels and, for each of them, the finer gutter texels
        inside it. The source of the coarser texel is the mean of the sources of the finer ones, without
        outliers
    """

    starts: Buffer
    sides: Buffer
    halvings: tuple[Bindings, ...]


def make_gutter_tracing(device: Device, mesh: Mesh, atlas: Atlas, textures: AtlasTextures) -> GutterTracing:
    """Upload the buffers of `GutterTracing` for an atlas that has gutters."""
    starts, sides = (
        device.buffer(words, "STORAGE") for words in (_packed_path_starts(atlas), _packed_neighbours(mesh))
    )
    pairs = pairwise((textures, *textures.coarser))
    halvings = tuple(_halving_buffers(device, finer, coarser) for finer, coarser in pairs if coarser.gutter)
    return GutterTracing(starts, sides, halvings)


def with_separate_gutters(device: Device, textures: AtlasTextures) -> AtlasTextures:
    """Return a copy of the atlas with separate gutter buffers, which `draw` fills for each person."""

    def with_empty_gutter_buffer(textures_at_mip: AtlasTextures) -> AtlasTextures:
        words = np.zeros((len(textures_at_mip.gutter_texels), GUTTER_ENTRY_BYTES // 4), np.uint32)
        return (
            replace(textures_at_mip, gutter=device.buffer(words, "STORAGE"))
            if len(words)
            else textures_at_mip
        )

    return replace(
        with_empty_gutter_buffer(textures), coarser=tuple(map(with_empty_gutter_buffer, textures.coarser))
    )


def _packed_path_starts(atlas: Atlas) -> Words:
    """Return (a, 5) words for gutter_trace.wgsl, one row for each gutter texel.

    Word 0 packs the coordinates of the texel. Words 1 and 2 are the point where the traced path starts: a
    triangle, and two packed barycentric weights. Words 3 and 4 are, as floats, the position (x, y) from which
    to copy light if tracing fails.
    """
    root = np.full((atlas.size, atlas.size), -1, np.int64)
    root[atlas.outside[:, 1], atlas.outside[:, 0]] = np.arange(len(atlas.outside))
    x, y = atlas.gutter.T.astype(np.uint32)
    index = root[y, x]
    second, third = atlas.border_weights[index].T.astype(np.uint32)
    start = np.stack(
        [x | (y << 16), atlas.border_triangle[index].astype(np.uint32), second | (third << 16)], axis=1
    )
    return np.concatenate([start, np.ascontiguousarray(atlas.source).view(np.uint32)], axis=1)


def _packed_neighbours(mesh: Mesh) -> Words:
    """Return (f, 3) words for gutter_trace.wgsl: the packed neighbour across each edge of each triangle.

    A word packs the index of the neighbouring triangle, the index of the shared edge in that triangle, and
    whether the orientation of the neighbour is reversed.
    """
    neighbour, neighbour_side, flipped = side_neighbours(mesh)
    skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
    word = (neighbour.astype(np.uint32) << 3) | (neighbour_side.astype(np.uint32) << 1) | flipped
    return np.where((neighbour >= 0) & skin[neighbour], word, _NO_NEIGHBOUR_WORD).astype(np.uint32)


def _halving_buffers(
    device: Device, finer_textures: AtlasTextures, coarser_textures: AtlasTextures
) -> Bindings:
    """Upload, for each gutter texel of the coarser atlas, the list of the finer gutter texels inside it.

    The source of the coarser texel, from which it copies light, is the mean of the sources of these texels,
    without outliers.
    """
    width = int(finer_textures.gutter_texels.max()) + 1

    def texel_index(texels: NDArray[np.integer]) -> NDArray[np.int64]:
        return texels[:, 1].astype(np.int64) * width + texels[:, 0]

    fine, coarse = texel_index(finer_textures.gutter_texels // 2), texel_index(coarser_textures.gutter_texels)
    order = np.argsort(fine, kind="stable")
    x, y = coarser_textures.gutter_texels.T.astype(np.uint32)
    squares = np.column_stack([x | (y << 16), run_bounds(fine[order], coarse)])
    return {
        "squares": device.buffer(squares, "STORAGE"),
        "members": device.buffer(order.astype(np.uint32), "STORAGE"),
    }


def draw(
    graph: Recorder, atlas: AtlasTextures, gutter_tracing: GutterTracing, rest_head: HeadGeometry
) -> None:
    """Declare the passes that find, for each gutter texel, the position from which it copies light.

    The passes cover all resolutions of the atlas.

    atlas : result of `with_separate_gutters`; the passes fill its gutter buffers
    gutter_tracing : constant inputs of the passes
    rest_head : surface of the person at rest
    """
    device, size = graph.device, (("SIZE", atlas.resources["atlas"].size[0]),)
    assert atlas.gutter is not None
    paths = {"starts": gutter_tracing.starts, "sides": gutter_tracing.sides, "gutter": atlas.gutter}
    trace = program(device, "atlas/gutter_trace.wgsl", size)
    halve = program(device, "atlas/gutter_halve.wgsl")
    graph.dispatch(
        "gutters", trace, {**rest_head.resources, **paths}, workgroup_grid(len(atlas.gutter_texels))
    )
    levels = [level for level in (atlas, *atlas.coarser) if level.gutter]
    for (finer, coarser), halving in zip(pairwise(levels), gutter_tracing.halvings, strict=True):
        assert finer.gutter is not None and coarser.gutter is not None
        bound = {**halving, "finer": finer.gutter, "coarser": coarser.gutter}
        graph.dispatch("gutters", halve, bound, workgroup_grid(len(coarser.gutter_texels)))
