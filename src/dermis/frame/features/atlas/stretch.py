"""The stretch map: how an atlas lies on the current surface, at each of its resolutions."""

from __future__ import annotations

from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.shape.mesh import HeadResources
from dermis.frame.programs import TILE, each, program
from dermis.gpu import Device, Recorder, Texture, make_texture

_ROOTED_BYTES = 12  # of a texel in the list of stretch_beyond.wgsl


def draw(graph: Recorder, head: HeadResources, atlas: AtlasTextures) -> None:
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
