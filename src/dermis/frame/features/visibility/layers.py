"""The nearest surface in each pixel of one or more views: its depth or its triangle, a visibility buffer.

Two ways to one result. On the GPUs measured, a compute pass takes a fraction of the rasteriser's time;
software adapters rasterise faster than they compute.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from dermis.frame.features.shape.mesh import HeadResources
from dermis.frame.programs import FEATURES, program, shader_folders, suited
from dermis.frame.projection import Matrix, Views
from dermis.gpu import (
    Buffer,
    Constants,
    Device,
    DrawTarget,
    RasterProgram,
    Record,
    Recorder,
    Texture,
    TextureView,
    compiled,
    make_texture,
)
from dermis.gpu.program import Program
from dermis.gpu.textures import view_of

_GROUPS = 2048  # workgroups that keep a GPU busy; where there are more triangles, each takes more of them
_TAKEN = (8, 128)  # triangles of a workgroup of visibility_buffer.wgsl: fewest and most
_RUN = 16  # of them in a row in the mesh, where they are many and small
_GROUPS_PER_ROW = 32768
_TILE = (64, 32)  # pixels, in tiles.wgsl
_DEPTH, _FOUND, _BOTH = 0, 1, 2  # what visibility_buffer.wgsl records
_COARSEST_MM = 0.1  # steps of depth at which a sample's depth and triangle share a word


@dataclass(eq=False)
class Layers:
    """A texture array with a layer for each view, and what it takes to fill it.

    Even one view gets two layers: OpenGL takes a texture of one layer for no array.

    texture : depth (1 near, 0 nothing) as float, or triangle + 1 as uint where `triangles`
    depth : the rasteriser's depth attachments, one a layer, or one for all when triangles are wanted
    targets : the rasteriser's colour targets, one a layer
    nearness, found, tiles : the compute pass' buffers; `found` is made when a frame needs it
    """

    texture: Texture
    size: tuple[int, int]
    count: int
    triangles: bool
    depth: list[TextureView]
    targets: Sequence[TextureView | None]
    nearness: Buffer | None = None
    found: Buffer | None = None
    tiles: Buffer | None = None


def make_layers(
    device: Device, size: tuple[int, int], count: int, *, triangles: bool, compute: bool | None = None
) -> Layers:
    """Space for `count` views of size (width, height); those too large for a buffer are rasterised.

    triangles : whether the layers hold triangles rather than depths
    compute : whether to rasterise in compute; None chooses by the adapter
    """
    compute = device.adapter.kind != "CPU" if compute is None else compute
    fits = 4 * size[0] * size[1] * count <= device.max_storage_bytes
    make = _compute_layers if compute and fits else _raster_layers
    return make(device, size, max(1, count), triangles)


def draw_layers(graph: Recorder, stage: str, layers: Layers, views: Views, head: HeadResources) -> None:
    """Fill a layer for each sample of each view; depth 1 is near and 0 far."""
    if layers.nearness is not None:
        _draw_compute(graph, stage, layers, views, head)
    else:
        _draw_raster(graph, stage, layers, views.matrices(layers.size), head)


def draw(graph: Recorder, visibility: Layers, views: Views, head: HeadResources) -> None:
    """Find the triangle that each sample of the image sees [Burns2013]; shading happens later, in compute."""
    draw_layers(graph, "visibility", visibility, views, head)


def _compute_layers(device: Device, size: tuple[int, int], count: int, triangles: bool) -> Layers:
    texel, name = ("r32uint", "visibility buffer") if triangles else ("r32float", "shadow maps")
    texture = make_texture(device, size, texel, layers=max(2, count), name=name)
    across, down = _tiles(size)
    counts = size[0] * size[1] * count, 1, across * down * count
    nearness, found, tiles = (_words(device, number) for number in counts)
    return Layers(texture, size, count, triangles, [], [], nearness, found, tiles)


def _words(device: Device, count: int) -> Buffer:
    return device.buffer(np.zeros(count, np.uint32), "STORAGE")


def _raster_layers(device: Device, size: tuple[int, int], count: int, triangles: bool) -> Layers:
    name = "visibility buffer" if triangles else "shadow maps"

    def layered(texel: str, number: int) -> tuple[Texture, list[TextureView]]:
        texture = make_texture(device, size, texel, layers=max(2, number), use="raster", name=name)
        return texture, [view_of(texture, layer=k) for k in range(number)]

    if not triangles:
        texture, depth = layered("depth32float", count)
        return Layers(texture, size, count, triangles, depth, [None] * count)
    _, depth = layered("depth32float", 1)
    texture, targets = layered("r32uint", count)
    return Layers(texture, size, count, triangles, depth * count, targets)


def _draw_compute(graph: Recorder, stage: str, layers: Layers, views: Views, head: HeadResources) -> None:
    device, triangles, (clips, places) = graph.device, head.triangles, views
    resolve = program(
        device, "visibility/resolve_triangles.wgsl" if layers.triangles else "visibility/resolve_depth.wgsl"
    )
    record, recorded = _views(resolve, layers, clips, head), _recorded(layers, triangles, clips)
    record["sample"][: len(places), :2] = places
    across, down = places.T.tolist()
    record["reach"] = min(across), min(down), max(across), max(down)
    record["index_bits"] = triangles.bit_length() if recorded == (_BOTH,) else 0
    assert layers.nearness is not None and layers.found is not None and layers.tiles is not None
    if _FOUND in recorded and layers.found.size < layers.nearness.size:
        layers.found = _words(device, layers.nearness.size // 4)
    resources = {
        **head.resources,
        "views": record,
        "nearness": layers.nearness,
        "found": layers.found,
        "tiles": layers.tiles,
        "layers": layers.texture,
    }
    shared, count = _shared_out(triangles, len(clips), len(places))
    groups = (min(count, _GROUPS_PER_ROW), -(-count // _GROUPS_PER_ROW), len(clips))
    for what in recorded:
        constants = (("RECORDED", what), ("SAMPLES", len(places)), *shared)
        graph.dispatch(
            stage, program(device, "visibility/visibility_buffer.wgsl", constants), resources, groups
        )
    graph.dispatch(stage, resolve, resources, (*_tiles(layers.size), layers.count))


def _recorded(layers: Layers, triangles: int, clips: Matrix) -> tuple[int, ...]:
    """What each draw records, in order: depth and triangle in one word where that is precise enough."""
    if not layers.triangles:
        return (_DEPTH,)
    steps = 2.0 ** (32 - triangles.bit_length())
    fine = max(map(_depth_range_mm, clips)) <= _COARSEST_MM * steps
    return (_BOTH,) if fine else (_DEPTH, _FOUND)


def _draw_raster(graph: Recorder, stage: str, layers: Layers, clips: Matrix, head: HeadResources) -> None:
    shader = _raster_program(graph.device, layers.triangles)
    resources = {**head.resources, "views": _views(shader, layers, clips, head)}
    for layer, (depth, target) in enumerate(zip(layers.depth, layers.targets, strict=True)):
        indices, into = None if layers.triangles else head.indices, DrawTarget(depth, 0.0, target)
        graph.draw(stage, shader, resources, 3 * head.triangles, into, indices=indices, layer=layer)


def _raster_program(device: Device, triangles: bool) -> RasterProgram:
    def make() -> RasterProgram:
        name = "visibility/visibility_buffer_raster.wgsl" if triangles else "visibility/depth_raster.wgsl"
        path, folders = FEATURES / name, shader_folders()
        chosen, target = suited(device, path, folders), "r32uint" if triangles else None
        return RasterProgram(device, path, folders, chosen, target=target, depth_compare="greater")

    return compiled(device, ("visibility buffer", triangles), (), make)


def _views(shader: Program, layers: Layers, clips: Matrix, head: HeadResources) -> Record:
    record = shader.record("Views", triangles=head.triangles)
    record["width"], record["height"] = layers.size
    record["clip"][: len(clips)] = clips.swapaxes(1, 2)
    return record


def _depth_range_mm(clip: Matrix) -> float:
    """Distance between depths 0 and 1 if all depths were as coarse as the coarsest [mm]."""
    rows: list[list[float]] = clip.tolist()
    _, _, (*depth, start), (*away, before) = rows
    scale = sum(a * a for a in away)
    if scale == 0.0:  # parallel rays
        return 1.0 / math.hypot(*depth)
    slope = sum(d * a for d, a in zip(depth, away, strict=True)) / scale  # depth = slope + rise / distance
    rise = start - slope * before
    return rise / (slope * slope) / math.sqrt(scale)


@cache
def _shared_out(triangles: int, views: int, samples: int) -> tuple[Constants, int]:
    """Pipeline constants for so many triangles, tuned on an H200, and the number of workgroups."""
    fewest, most = _TAKEN
    taken = min(most, max(fewest, 1 << (triangles * views // _GROUPS).bit_length() >> 1))
    many = taken == most  # and small
    threads = 256 if many or samples > 1 else 128
    run, small = (_RUN, 32) if many else (1, 16)
    return (("TAKEN", taken), ("RUN", run), ("SMALL", small), ("THREADS", threads)), -(-triangles // taken)


def _tiles(size: tuple[int, int]) -> tuple[int, int]:
    """Tiles across and down."""
    return -(-size[0] // _TILE[0]), -(-size[1] // _TILE[1])
