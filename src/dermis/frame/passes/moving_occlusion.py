"""Ambient occlusion of a head that moves: the baked map, changed as the sky at the vertices changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dermis.frame.atlas_layout import AtlasLayout, MovingOcclusion
from dermis.frame.geometry import HeadResources, upload_bare
from dermis.frame.passes import TILE, each, program
from dermis.frame.passes.visibility_buffer import Drawer, Layers, draw_layers, make_layers
from dermis.frame.sky import SIDE, VIEWS, Look, look_around
from dermis.gpu import CommandList, Device, make_texture
from dermis.mesh.head import Head
from dermis.mesh.outline import Outline
from dermis.mesh.subdivide import coarse_triangles

_VERTICES = "moving_occlusion_vertices.wgsl"
_OCCLUDERS = (
    5_000,
    0.4,
)  # faces, at least; how far the others may be off the surface [mm], a quarter of a texel


@dataclass(frozen=True, eq=False)
class Sky:
    """The open share of the sky at a head's vertices.

    layers : depth maps from all around
    occluders : triangles that are seen there, fewer than the head's: the maps are no finer
    shares : buffer of two for each vertex, as it rests and as it is now
    vertices : count
    """

    layers: Layers
    occluders: HeadResources
    shares: Any
    vertices: int


def make_sky(device: Device, head: Head, resting: HeadResources) -> Sky:
    """Space for the shares, and those of the head as it rests.

    resting : its surface then
    """
    count, rig, frame = len(head.mesh.positions), head.control, CommandList(device, timed=False)
    layers = make_layers(device, (SIDE, SIDE), VIEWS, triangles=False)
    occluders = upload_bare(device, coarse_triangles(head, *_OCCLUDERS))
    sky = Sky(layers, occluders, device.buffer(np.zeros((count, 2), np.float32), "STORAGE"), count)
    look = look_around(Outline(rig.outline_mm(rig.rest)), np.eye(3))
    _draw_vertices(frame, sky, look, sky_record(device, look, count), resting, True)
    frame.submit()
    return sky


def make_map(device: Device, resting: Any) -> tuple[Any, MovingOcclusion]:
    """An empty map like one of a head as it rests, and what it is to be made from."""
    side, rows = resting.size[:2]
    corners = make_texture(device, (side, side), "rgba32uint")
    return make_texture(device, (side, rows), "r32float"), MovingOcclusion(resting, corners)


def draw(graph: Drawer, sky: Sky, look: Look, record: Any, layouts: Sequence[AtlasLayout]) -> None:
    """Let the maps of all layouts follow the shape.

    record : from `sky_record`
    """
    _draw_vertices(graph, sky, look, record, layouts[0].head)
    for layout in layouts:
        if layout.occlusion:
            _draw_map(graph, sky, layout, layout.occlusion)


def _draw_map(graph: Drawer, sky: Sky, layout: AtlasLayout, follows: MovingOcclusion) -> None:
    """Fill a layout's map; where its texels lie is found once."""
    moved = layout.lit["occlusion_map"]
    bound = {**layout.head.resources, "atlas": layout.atlas.resources["atlas"], "corners": follows.corners}
    find = program(graph.device, "moving_occlusion_corners.wgsl")
    graph.compute("occlusion", find, bound, follows.corners.size[:2])
    made = {"resting_map": follows.resting, "shares": sky.shares, "moved_map": moved}
    fill = program(graph.device, "moving_occlusion.wgsl")
    graph.compute("occlusion", fill, bound | made, moved.size[:2], TILE)


def sky_record(device: Device, look: Look, vertices: int) -> Any:
    """The shader's record of views from all around."""
    record = program(device, _VERTICES).record("Sky", vertices=vertices)
    views = record["views"]
    views["column"], views["row"], views["depth"] = look.to_map.swapaxes(0, 1)
    views["towards"] = look.towards
    views["right"], views["up"] = look.steps_mm.swapaxes(0, 1)
    return record


def _draw_vertices(
    graph: Drawer, sky: Sky, look: Look, record: Any, head: HeadResources, resting: bool = False
) -> None:
    """Find the shares of a head as it is drawn now."""
    draw_layers(graph, "occlusion", sky.layers, look.views, sky.occluders.placed(head))
    bound = {**head.resources, "sky": record, "maps": sky.layers.texture, "shares": sky.shares}
    find = program(graph.device, _VERTICES, (("RESTING", resting),) if resting else ())
    graph.dispatch("occlusion", find, bound, each(sky.vertices))
