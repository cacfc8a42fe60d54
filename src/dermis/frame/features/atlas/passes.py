"""Passes of the atlas: stretch maps, gutters that continue the surface, and blending of two layouts."""

from __future__ import annotations

from dermis.frame.features.atlas.lit import LitAtlas
from dermis.frame.features.atlas.textures import ENTRY_BYTES, AtlasTextures
from dermis.frame.features.shape.mesh import HeadResources
from dermis.frame.programs import TILE, each, program
from dermis.frame.seams import FEATHER_MM
from dermis.gpu import Device, Recorder, Texture, TextureOrView, make_texture

_ROOTED_BYTES = 12  # of a texel in the list of stretch_beyond.wgsl
_ROW = 1024  # as in gutter.wgsl


def draw_stretch(graph: Recorder, head: HeadResources, atlas: AtlasTextures) -> None:
    """Fill the stretch maps of an atlas and of its coarser ones."""
    device, bound, constants = graph.device, {**head.resources, **atlas.resources}, atlas.stretching
    bound.setdefault("edge_map", _no_edges(device))
    own = program(device, "atlas/stretch.wgsl", constants)
    graph.compute("stretch", own, bound, atlas.resources["atlas"].size[:2])
    if atlas.rooted is not None:
        beyond = program(device, "atlas/stretch_beyond.wgsl", constants)
        listed = bound | {"rooted": atlas.rooted}
        groups = each(atlas.rooted.size // _ROOTED_BYTES)
        graph.dispatch("stretch", beyond, listed, groups, completes="stretch_map")
    draw_coarser(graph, atlas)


def draw_coarser(graph: Recorder, atlas: AtlasTextures) -> None:
    """Fill the stretch maps of the coarser atlases from that of the finest."""
    finer, halve = atlas.resources, program(graph.device, "atlas/stretch_halve.wgsl")
    for sheet in atlas.coarser:
        maps = {"finer": finer["stretch_map"], "reach_map": finer["reach_map"]}
        coarser = sheet.resources["stretch_map"]
        graph.compute("stretch", halve, maps | {"stretch_map": coarser}, coarser.size[:2], TILE)
        finer = sheet.resources


def _no_edges(device: Device) -> Texture:
    """Return a placeholder for the distances to the edges."""
    return device.shared("no edges", lambda: make_texture(device, (1, 1), "r32float", use="map"))


def draw_gutters(graph: Recorder, stage: str, atlas: AtlasTextures, light: TextureOrView, texel: str) -> None:
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


def draw_blend(graph: Recorder, first: LitAtlas, second: LitAtlas, into: Texture) -> None:
    """Blend the first layout's light, near its edges the second's, into a texture of the first's atlas."""
    bound = {
        **second.lit,  # whose triangle table has places in the second layout
        **first.atlas.resources,
        "first": first.scattered,
        "second": second.scattered,
        "blended": into,
    }
    shader = program(graph.device, "atlas/blend.wgsl", (("FADE_MM", FEATHER_MM),))
    graph.compute("blend", shader, bound, into.size[:2])
