"""Rasterisation of the nearest surface in each pixel of one or more views: its depth or its triangle.

There are two implementations: a compute pass, which is several times faster on GPUs, and the rasteriser,
which is faster on software adapters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.frame.programs import FEATURES_FOLDER, program, program_constants, shader_folders
from dermis.frame.projection import Matrix, Views
from dermis.gpu import (
    Buffer,
    Constants,
    Device,
    DrawTarget,
    Recorder,
    RenderProgram,
    Texture,
    TextureView,
    UniformRecord,
    cached_program,
    make_texture,
)
from dermis.gpu.program import Program
from dermis.gpu.textures import make_view

_TARGET_WORKGROUP_COUNT = (
    2048  # number of workgroups that occupy a GPU; for large meshes each takes more triangles
)
_TRIANGLES_PER_WORKGROUP_RANGE = (8, 128)  # least and most triangles of a workgroup of visibility_buffer.wgsl
_CONSECUTIVE_TRIANGLES_PER_WORKGROUP = (
    16  # consecutive triangles per workgroup of a mesh with many small triangles
)
_WORKGROUPS_PER_ROW = 32768
_TILE_PIXELS = (64, 32)  # width and height of a tile, as in tiles.wgsl
_RECORD_DEPTH, _RECORD_TRIANGLE, _RECORD_BOTH = 0, 1, 2  # modes of visibility_buffer.wgsl: what it records
_MAX_DEPTH_STEP_MM = 0.1  # largest step of depth for which depth and triangle of a sample share one word


@dataclass(eq=False)
class ViewLayers:
    """Texture array with a layer for each view, and the resources that fill it.

    A single view gets two layers, because OpenGL does not treat a texture of one layer as an array.

    texture : depth as float (1 near, 0 nothing), or triangle index plus 1 as integer if `triangles` is true
    size : (width, height) of each layer [pixels]
    count : number of layers in use
    triangles : whether layers store triangle indices instead of depth
    depth : depth attachments of the rasteriser: one for each layer, or a single attachment if `triangles` is
        true
    targets : colour targets of the rasteriser, one for each layer; None for layers of depth
    nearness : buffer of the compute pass: depth at each sample, in some modes packed with the triangle index
    triangle_ids : buffer of the compute pass: triangle index at each sample, allocated on first use
    tiles : buffer of the compute pass: state of each tile of pixels
    """

    texture: Texture
    size: tuple[int, int]
    count: int
    triangles: bool
    depth: list[TextureView]
    targets: Sequence[TextureView | None]
    nearness: Buffer | None = None
    triangle_ids: Buffer | None = None
    tiles: Buffer | None = None


def make_layers(
    device: Device,
    layer_size: tuple[int, int],
    layer_count: int,
    *,
    store_triangles: bool,
    use_compute_pass: bool | None = None,
) -> ViewLayers:
    """Allocate `layer_count` layers of size (width, height).

    If the layers do not fit in a buffer, they are filled by the rasteriser.

    store_triangles : whether the layers store triangle indices instead of depth
    use_compute_pass : whether to use the compute pass instead of the rasteriser; None selects
        whichever is faster on the adapter
    """
    use_compute_pass = device.adapter.kind != "CPU" if use_compute_pass is None else use_compute_pass
    fits = 4 * layer_size[0] * layer_size[1] * layer_count <= device.max_storage_bytes
    make = _make_compute_layers if use_compute_pass and fits else _make_raster_layers
    return make(device, layer_size, max(1, layer_count), store_triangles)


def draw_layers(
    graph: Recorder, stage_name: str, layers: ViewLayers, views: Views, head: HeadGeometry
) -> None:
    """Declare the passes that fill the layers, one layer for each sample position of each view.

    stage_name : name of the stage in timings
    """
    if layers.nearness is not None:
        _draw_with_compute_pass(graph, stage_name, layers, views, head)
    else:
        _draw_with_rasteriser(graph, stage_name, layers, views.clip_matrices_of_samples(layers.size), head)


def draw(graph: Recorder, visibility_layers: ViewLayers, views: Views, head: HeadGeometry) -> None:
    """Declare the passes that find the triangle that covers each sample of the picture [Burns2013]."""
    draw_layers(graph, "visibility", visibility_layers, views, head)


def _make_compute_layers(
    device: Device, layer_size: tuple[int, int], layer_count: int, store_triangles: bool
) -> ViewLayers:
    texel, name = ("r32uint", "visibility buffer") if store_triangles else ("r32float", "shadow maps")
    texture = make_texture(device, layer_size, texel, layer_count=max(2, layer_count), texture_name=name)
    across, down = _tile_counts(layer_size)
    counts = layer_size[0] * layer_size[1] * layer_count, 1, across * down * layer_count
    return ViewLayers(
        texture,
        layer_size,
        layer_count,
        store_triangles,
        [],
        [],
        *(_word_buffer(device, one) for one in counts),
    )


def _word_buffer(device: Device, word_count: int) -> Buffer:
    return device.buffer(np.zeros(word_count, np.uint32), "STORAGE")


def _make_raster_layers(
    device: Device, layer_size: tuple[int, int], view_count: int, store_triangles: bool
) -> ViewLayers:
    name = "visibility buffer" if store_triangles else "shadow maps"

    def make_layered_texture(texel_format: str, layer_count: int) -> tuple[Texture, list[TextureView]]:
        texture = make_texture(
            device,
            layer_size,
            texel_format,
            layer_count=max(2, layer_count),
            content_source="raster",
            texture_name=name,
        )
        return texture, [make_view(texture, layer=k) for k in range(layer_count)]

    if not store_triangles:
        texture, depth = make_layered_texture("depth32float", view_count)
        return ViewLayers(texture, layer_size, view_count, store_triangles, depth, [None] * view_count)
    _, depth = make_layered_texture("depth32float", 1)
    texture, targets = make_layered_texture("r32uint", view_count)
    return ViewLayers(texture, layer_size, view_count, store_triangles, depth * view_count, targets)


def _draw_with_compute_pass(
    graph: Recorder, stage_name: str, layers: ViewLayers, views: Views, head: HeadGeometry
) -> None:
    device, triangles, (clips, positions) = graph.device, head.triangles, views
    name = "resolve_triangles" if layers.triangles else "resolve_depth"
    resolve = program(device, f"visibility/{name}.wgsl")
    record, passes = _views_record(resolve, layers, clips, head), _pass_modes(layers, triangles, clips)
    record["sample"][: len(positions), :2] = positions
    across, down = positions.T.tolist()
    record["sample_bounds"] = min(across), min(down), max(across), max(down)
    record["index_bits"] = triangles.bit_length() if passes == (_RECORD_BOTH,) else 0
    assert layers.nearness is not None and layers.triangle_ids is not None and layers.tiles is not None
    if _RECORD_TRIANGLE in passes and layers.triangle_ids.size < layers.nearness.size:
        layers.triangle_ids = _word_buffer(device, layers.nearness.size // 4)
    resources = {
        **head.resources,
        "views": record,
        "nearness": layers.nearness,
        "triangle_ids": layers.triangle_ids,
        "tiles": layers.tiles,
        "layers": layers.texture,
    }
    work, count = _divide_triangles_into_workgroups(triangles, len(clips), len(positions))
    groups = (min(count, _WORKGROUPS_PER_ROW), -(-count // _WORKGROUPS_PER_ROW), len(clips))
    for recorded in passes:
        constants = (("RECORDED", recorded), ("SAMPLES", len(positions)), *work, *head.cutout_constants)
        shader = program(device, "visibility/visibility_buffer.wgsl", constants)
        graph.dispatch(stage_name, shader, resources, groups)
    graph.dispatch(stage_name, resolve, resources, (*_tile_counts(layers.size), layers.count))


def _pass_modes(layers: ViewLayers, triangle_count: int, clip_matrices: Matrix) -> tuple[int, ...]:
    """Return the mode of each pass of visibility_buffer.wgsl: whether it records depth, triangles or both.

    One pass is enough if only depth is stored, or if depth and triangle fit in one word; otherwise the first
    pass records depth and the second records triangles.

    triangle_count : number of triangles
    clip_matrices : (k, 4, 4) matrices from world to clip space
    """
    if not layers.triangles:
        return (_RECORD_DEPTH,)
    steps = 2.0 ** (32 - triangle_count.bit_length())
    precise = max(map(_max_distance_per_depth_mm, clip_matrices)) <= _MAX_DEPTH_STEP_MM * steps
    return (_RECORD_BOTH,) if precise else (_RECORD_DEPTH, _RECORD_TRIANGLE)


def _draw_with_rasteriser(
    graph: Recorder, stage_name: str, layers: ViewLayers, clip_matrices: Matrix, head: HeadGeometry
) -> None:
    shader = _raster_program(graph.device, layers.triangles, head.has_cutouts)
    resources = {**head.resources, "views": _views_record(shader, layers, clip_matrices, head)}
    for layer, (depth, target) in enumerate(zip(layers.depth, layers.targets, strict=True)):
        indexed = not (layers.triangles or head.has_cutouts)  # else the shader finds the corners itself
        indices, into = head.indices if indexed else None, DrawTarget(depth, 0.0, target)
        graph.draw(
            stage_name,
            shader,
            resources,
            3 * head.triangles,
            into,
            index_buffer=indices,
            instance_index=layer,
        )


def _raster_program(device: Device, store_triangles: bool, has_cutouts: bool) -> RenderProgram:
    """Return the program that rasterises triangle indices or depth.

    has_cutouts : whether opacity maps cut holes, which needs a fragment shader even if only depth is drawn
    """

    def compile_program() -> RenderProgram:
        by_triangle = store_triangles or has_cutouts
        name = "visibility/visibility_buffer_raster.wgsl" if by_triangle else "visibility/depth_raster.wgsl"
        path, folders = FEATURES_FOLDER / name, shader_folders(*(("CUTOUTS",) if has_cutouts else ()))
        constants, targets = program_constants(device, path, folders), ["r32uint"] if store_triangles else []
        return RenderProgram(
            device,
            path,
            folders,
            constants,
            targets=targets,
            depth_compare="greater",
            has_fragment=by_triangle,
        )

    return cached_program(device, ("visibility buffer", store_triangles, has_cutouts), (), compile_program)


def _views_record(
    shader: Program, layers: ViewLayers, clip_matrices: Matrix, head: HeadGeometry
) -> UniformRecord:
    record = shader.make_record("Views", triangles=head.triangles)
    record["width"], record["height"] = layers.size
    record["clip"][: len(clip_matrices)] = clip_matrices.swapaxes(1, 2)
    return record


def _max_distance_per_depth_mm(clip_matrix: Matrix) -> float:
    """Return an upper bound of the change of distance per unit of z-buffer depth [mm].

    If depth is stored as an integer, the error of the distance is at most this bound divided by the number of
    integer steps.

    clip_matrix : (4, 4) matrix from world to clip space
    """
    rows: list[list[float]] = clip_matrix.tolist()
    _, _, (*depth, depth_offset), (*distance, distance_offset) = rows
    scale = sum(d * d for d in distance)
    if scale == 0.0:  # parallel rays
        return 1.0 / math.hypot(*depth)
    slope = (
        sum(a * b for a, b in zip(depth, distance, strict=True)) / scale
    )  # depth = slope + rise / distance
    rise = depth_offset - slope * distance_offset
    return rise / (slope * slope) / math.sqrt(scale)


@cache
def _divide_triangles_into_workgroups(
    triangle_count: int, view_count: int, sample_count: int
) -> tuple[Constants, int]:
    """Divide the triangles among the workgroups of the compute pass; the numbers were tuned on an H200.

    Return pipeline constants, and the number of workgroups.

    triangle_count : number of triangles
    view_count : number of views
    sample_count : number of samples per pixel
    """
    fewest, most = _TRIANGLES_PER_WORKGROUP_RANGE
    per_group = min(
        most, max(fewest, 1 << (triangle_count * view_count // _TARGET_WORKGROUP_COUNT).bit_length() >> 1)
    )
    many = per_group == most  # meshes of many triangles have small ones
    threads = 256 if many or sample_count > 1 else 128
    run, small = (_CONSECUTIVE_TRIANGLES_PER_WORKGROUP, 32) if many else (1, 16)
    constants = ("TRIANGLES", per_group), ("RUN", run), ("SMALL", small), ("THREADS", threads)
    return constants, -(-triangle_count // per_group)


def _tile_counts(picture_size: tuple[int, int]) -> tuple[int, int]:
    """Return the number of tiles, across and down, of a picture of size (width, height).

    The compute pass of visibility_buffer.wgsl marks the tiles into which it draws, so that empty tiles can be
    skipped when the result is copied to a texture.
    """
    return -(-picture_size[0] // _TILE_PIXELS[0]), -(-picture_size[1] // _TILE_PIXELS[1])
