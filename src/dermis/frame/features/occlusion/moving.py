"""Ambient occlusion of a moving head: the baked map, changed as the open sky at the vertices changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.atlas.lit import LitAtlas
from dermis.frame.features.shape.mesh import HeadResources, upload_bare
from dermis.frame.features.visibility.layers import Layers, draw_layers, make_layers
from dermis.frame.programs import TILE, each, program
from dermis.frame.projection import MIDDLE, Views, frame_of
from dermis.gpu import Bindings, Buffer, CommandList, Device, Record, Recorder, Texture, make_texture
from dermis.mesh.geometry import fibonacci_sphere
from dermis.mesh.head import Head
from dermis.mesh.morph_targets import no_targets
from dermis.mesh.outline import Outline, RigOutline, outline_of
from dermis.mesh.rig import Motion
from dermis.mesh.subdivide import coarse_triangles

Floats = NDArray[np.float64]
VIEWS = 64
SIDE = 256
"""Texels along the side of a depth map."""
_MARGIN_MM = 1.0
_BORDER = 2.0  # texels around the head: what is lifted off its surface stays inside
_AROUND_MM = 100.0  # how far from a head's middle its points count
_MOST_POINTS = 512
_VERTICES = "occlusion/moving_occlusion_vertices.wgsl"
_OCCLUDERS = (
    5_000,
    0.4,
)  # faces, at least; how far the others may be off the surface [mm], a quarter of a texel


class Look(NamedTuple):
    """Views from all around.

    views : of the depth maps
    to_map : (k, 3, 4) from points to columns and rows [texel], and to depth
    towards : (k, 3) unit vectors to where they look from
    steps_mm : (k, 2, 3) from a texel to the one on its right and to the one above
    """

    views: Views
    to_map: Floats
    towards: Floats
    steps_mm: Floats


@dataclass(frozen=True, eq=False)
class Anchors:
    """Points that tell how a head is turned.

    points : (s,) of the control points
    arms : (s, 3) from their middle at rest, as much as they count
    outline : them, with the bones that move them
    """

    points: NDArray[np.intp]
    arms: Floats
    outline: RigOutline


def look_around(outline: Outline, turn: Floats) -> Look:
    """The tightest views of a shape from all around.

    turn : (3, 3) rotation that the directions follow
    """
    axes = _axes() @ turn.T
    seen = (axes.reshape(-1, 3).astype(np.float32) @ outline.columns[:3]).reshape(*axes.shape[:2], -1)
    low, high = seen.min(axis=2).astype(np.float64), seen.max(axis=2).astype(np.float64)
    half, middle = 0.5 * (high - low) + _MARGIN_MM, 0.5 * (high + low)
    half[:, 2] += outline.slack_mm
    half[:, :2] *= SIDE / (SIDE - 2.0 * _BORDER)
    clips = np.zeros((VIEWS, 4, 4))
    clips[:, :3, :3], clips[:, :3, 3] = axes / half[..., None], -middle / half
    clips[:, 2] *= -0.5  # from 1 near to 0 far
    clips[:, 2, 3] += 0.5
    clips[:, 3, 3] = 1.0
    to_map = clips[:, :3].copy()
    to_map[:, :2] *= 0.5 * SIDE * np.array([[1.0], [-1.0]])
    to_map[:, :2, 3] += 0.5 * SIDE - 0.5
    steps = axes[:, :2] * (2.0 / SIDE * half[:, :2, None])
    return Look(Views(clips, MIDDLE), to_map, -axes[:, 2], steps)


@lru_cache(maxsize=1)
def _axes() -> Floats:
    """(k, 3, 3) right, up and forward."""
    return np.array([frame_of(-towards, np.array([0.0, 1.0, 0.0])) for towards in fibonacci_sphere(VIEWS)])


def anchors_of(head: Head) -> Anchors:
    """Those near the head's middle: a turn of the neck counts, shoulders that stay do not."""
    rig = head.control
    points = np.unique(np.linspace(0, len(rig.positions_mm) - 1, _MOST_POINTS).astype(np.intp))
    places = rig.positions_mm[points].astype(np.float64)
    weight = np.exp(-((places - head.centre_mm) ** 2).sum(axis=1) / _AROUND_MM**2)[:, None]
    arms = weight * (places - (weight * places).sum(axis=0) / weight.sum())
    return Anchors(points, arms, outline_of(rig.positions_mm, no_targets(), rig.skeleton, points))


def turn_of(anchors: Anchors, motion: Motion) -> Floats:
    """(3, 3) rotation of a head as a whole: the nearest to what its points do [Kabsch1976].

    Morph targets do not turn a head, and are left out.
    """
    rest = anchors.outline.rest_mm.copy()
    rest[:3] = motion.positions_mm[anchors.points].T
    moved = replace(anchors.outline, rest_mm=rest).posed(np.zeros(0, np.float32), motion.matrices)
    left, _, right = np.linalg.svd(moved.T.astype(np.float64) @ anchors.arms)
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    return np.asarray(left @ right)


@dataclass(frozen=True, eq=False)
class MovingOcclusion:
    """What an occlusion map is made from that follows the head's shape.

    resting : texture of the open sky as the head rests
    corners : texture of the vertices between which each texel lies, as moving_occlusion_corners.wgsl fills it
    """

    resting: Texture
    corners: Texture


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
    shares: Buffer
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


def make_map(device: Device, resting: Texture) -> tuple[Texture, MovingOcclusion]:
    """An empty map like one of a head as it rests, and what it is to be made from."""
    side, rows = resting.size[:2]
    corners = make_texture(device, (side, side), "rgba32uint")
    return make_texture(device, (side, rows), "r32float"), MovingOcclusion(resting, corners)


def draw(
    graph: Recorder,
    sky: Sky,
    look: Look,
    record: Record,
    maps: Sequence[tuple[LitAtlas, MovingOcclusion | None]],
) -> None:
    """Update the occlusion maps of all layouts for the current shape.

    record : from `sky_record`
    """
    _draw_vertices(graph, sky, look, record, maps[0][0].head)
    for layout, follows in maps:
        if follows:
            _draw_map(graph, sky, layout, follows)


def _draw_map(graph: Recorder, sky: Sky, layout: LitAtlas, follows: MovingOcclusion) -> None:
    """Fill a layout's map; where its texels lie is found once."""
    moved = cast(Texture, layout.lit["occlusion_map"])
    bound: Bindings = {
        **layout.head.resources,
        "atlas": layout.atlas.resources["atlas"],
        "corners": follows.corners,
    }
    find = program(graph.device, "occlusion/moving_occlusion_corners.wgsl")
    graph.compute("occlusion", find, bound, follows.corners.size[:2])
    made: Bindings = {"resting_map": follows.resting, "shares": sky.shares, "moved_map": moved}
    fill = program(graph.device, "occlusion/moving_occlusion.wgsl")
    graph.compute("occlusion", fill, {**bound, **made}, moved.size[:2], TILE)


def sky_record(device: Device, look: Look, vertices: int) -> Record:
    """The shader's record of views from all around."""
    record = program(device, _VERTICES).record("Sky", vertices=vertices)
    views = record["views"]
    views["column"], views["row"], views["depth"] = look.to_map.swapaxes(0, 1)
    views["towards"] = look.towards
    views["right"], views["up"] = look.steps_mm.swapaxes(0, 1)
    return record


def _draw_vertices(
    graph: Recorder, sky: Sky, look: Look, record: Record, head: HeadResources, resting: bool = False
) -> None:
    """Find the shares of a head as it is drawn now."""
    draw_layers(graph, "occlusion", sky.layers, look.views, sky.occluders.placed(head))
    bound: Bindings = {**head.resources, "sky": record, "maps": sky.layers.texture, "shares": sky.shares}
    find = program(graph.device, _VERTICES, (("RESTING", resting),) if resting else ())
    graph.dispatch("occlusion", find, bound, each(sky.vertices))
