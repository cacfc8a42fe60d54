"""The nearest surface in each pixel of one or more views: its depth or its triangle.

Two ways to one result. On the GPUs measured, a compute pass takes a fraction of the rasteriser's time;
software adapters rasterise faster than they compute.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from dermis.frame.geometry import HeadTextures
from dermis.frame.passes import SHARED_SHADERS, STAGES
from dermis.frame.passes.variants import Constants, Variants
from dermis.frame.projection import Matrix, Views
from dermis.gpu import ComputeProgram, Device, Frame, RasterProgram, make_texture

_GROUPS = 2048  # workgroups that keep a GPU busy; where there are more triangles, each takes more of them
_TAKEN = (8, 128)  # triangles of a workgroup of visibility_buffer.wgsl: fewest and most
_RUN = 16  # of them that follow each other, where they are many and so small
_GROUPS_PER_ROW = 32768
_TILE = (64, 32)  # pixels, in tiles.wgsl
_DEPTH, _FOUND, _BOTH = 0, 1, 2  # what visibility_buffer.wgsl records
_COARSEST_MM = 0.1  # steps of depth at which a sample's depth and triangle share a word


@dataclass
class Layers:
    """A texture array with a layer for each view, and what it takes to fill it.

    Even one view gets two layers: OpenGL takes a texture of one layer for no array.

    texture : depth (1 near, 0 nothing) as float, or triangle + 1 as uint
    depth : the rasteriser's depth attachments, one a layer, or one for all when triangles are wanted
    targets : the rasteriser's colour targets, one a layer
    nearness, found, tiles : the compute pass' buffers; triangles found get theirs when a frame needs it
    """

    texture: Any
    size: tuple[int, int]
    count: int
    depth: list[Any]
    targets: list[Any]
    nearness: Any = None
    found: Any = None
    tiles: Any = None


class Nearest:
    """Fills layers with depths or with triangles.

    triangles : whether the layers hold triangles rather than depths
    compute : which way to take; None chooses by the adapter
    """

    def __init__(self, device: Device, *, triangles: bool, compute: bool | None = None) -> None:
        self._device = device
        self._triangles = triangles
        self._compute = device.adapter.kind != "CPU" if compute is None else compute
        shared = (SHARED_SHADERS,)
        self._finders = Variants(device, STAGES / "visibility_buffer.wgsl")
        if self._compute:
            resolve = "resolve_triangles.wgsl" if triangles else "resolve_depth.wgsl"
            self._resolve = ComputeProgram(device, STAGES / resolve, shared)
        target = "r32uint" if triangles else None
        self._raster = RasterProgram(
            device, STAGES / "visibility_buffer_raster.wgsl", shared, target=target, depth_compare="greater"
        )

    def make_layers(self, size: tuple[int, int], count: int) -> Layers:
        """Space for `count` views of size (width, height); those too large for a buffer are rasterised."""
        fits = 4 * size[0] * size[1] * count <= self._device.max_storage_bytes
        make = self._compute_layers if self._compute and fits else self._raster_layers
        return make(size, max(1, count))

    def draw(self, frame: Frame, stage: str, layers: Layers, views: Views, head: HeadTextures) -> None:
        """Fill a layer for each place of each view; depth 1 is near and 0 far."""
        if layers.nearness is not None:
            self._draw_compute(frame, stage, layers, views, head)
        else:
            self._draw_raster(frame, stage, layers, views.matrices(layers.size), head)

    def _compute_layers(self, size: tuple[int, int], count: int) -> Layers:
        texel = "r32uint" if self._triangles else "r32float"
        texture = make_texture(self._device, size, texel, layers=max(2, count))
        across, down = _tiles(size)
        nearness, found, tiles = map(self._words, (size[0] * size[1] * count, 1, across * down * count))
        return Layers(texture, size, count, [], [], nearness, found, tiles)

    def _words(self, count: int) -> Any:
        return self._device.buffer(np.zeros(count, np.uint32), "STORAGE")

    def _raster_layers(self, size: tuple[int, int], count: int) -> Layers:
        def layered(texel: str, number: int) -> tuple[Any, list[Any]]:
            texture = make_texture(self._device, size, texel, layers=max(2, number), use="raster")
            options = {"dimension": "2d", "array_layer_count": 1}
            return texture, [texture.create_view(base_array_layer=k, **options) for k in range(number)]

        if not self._triangles:
            texture, depth = layered("depth32float", count)
            return Layers(texture, size, count, depth, [None] * count)
        _, depth = layered("depth32float", 1)
        texture, targets = layered("r32uint", count)
        return Layers(texture, size, count, depth * count, targets)

    def _draw_compute(
        self, frame: Frame, stage: str, layers: Layers, views: Views, head: HeadTextures
    ) -> None:
        triangles, (clips, places) = head.triangles, views
        record, recorded = self._views(self._resolve, layers, clips, head), self._recorded(triangles, clips)
        record["sample"][: len(places), :2] = places
        across, down = places.T.tolist()
        record["reach"] = min(across), min(down), max(across), max(down)
        record["index_bits"] = triangles.bit_length() if recorded == (_BOTH,) else 0
        if _FOUND in recorded and layers.found.size < layers.nearness.size:
            layers.found = self._words(layers.nearness.size // 4)
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
            finder = self._finders.program((("RECORDED", what), ("SAMPLES", len(places)), *shared))
            frame.dispatch(stage, finder, resources, groups)
        frame.dispatch(stage, self._resolve, resources, (*_tiles(layers.size), layers.count))

    def _recorded(self, triangles: int, clips: Matrix) -> tuple[int, ...]:
        """What is recorded, time after time: depth and triangle in one word where that is fine enough."""
        if not self._triangles:
            return (_DEPTH,)
        steps = 2.0 ** (32 - triangles.bit_length())
        fine = max(map(_depth_range_mm, clips)) <= _COARSEST_MM * steps
        return (_BOTH,) if fine else (_DEPTH, _FOUND)

    def _draw_raster(
        self, frame: Frame, stage: str, layers: Layers, clips: Matrix, head: HeadTextures
    ) -> None:
        resources = {**head.resources, "views": self._views(self._raster, layers, clips, head)}
        for layer, (depth, target) in enumerate(zip(layers.depth, layers.targets, strict=True)):
            frame.draw(
                stage,
                self._raster,
                resources,
                3 * head.triangles,
                layer=layer,
                depth=depth,
                far=0.0,
                target=target,
            )

    def _views(self, program: Any, layers: Layers, clips: Matrix, head: HeadTextures) -> Any:
        record = program.record("Views", triangles=head.triangles)
        record["width"], record["height"] = layers.size
        record["clip"][: len(clips)] = clips.swapaxes(1, 2)
        return record


def _depth_range_mm(clip: Matrix) -> float:
    """How far apart depths 0 and 1 would be if all depths were as coarse as the coarsest [mm]."""
    rows: list[list[float]] = clip.tolist()
    _, _, (*depth, start), (*away, before) = rows
    scale = sum(a * a for a in away)
    if scale == 0.0:  # parallel rays
        return 1.0 / math.hypot(*depth)
    slope = sum(d * a for d, a in zip(depth, away, strict=True)) / scale  # depth = slope + rise / distance
    rise = start - slope * before
    return rise / (slope * slope) / math.sqrt(scale)


def _shared_out(triangles: int, views: int, samples: int) -> tuple[Constants, int]:
    """What a workgroup takes when there are so many triangles, as one H200 was fastest, and their number."""
    fewest, most = _TAKEN
    taken = min(most, max(fewest, 1 << (triangles * views // _GROUPS).bit_length() >> 1))
    many = taken == most  # and small
    threads = 256 if many or samples > 1 else 128
    run, small = (_RUN, 32) if many else (1, 16)
    return (("TAKEN", taken), ("RUN", run), ("SMALL", small), ("THREADS", threads)), -(-triangles // taken)


def _tiles(size: tuple[int, int]) -> tuple[int, int]:
    """Tiles across and down."""
    return -(-size[0] // _TILE[0]), -(-size[1] // _TILE[1])
