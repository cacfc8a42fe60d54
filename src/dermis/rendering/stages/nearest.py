"""The nearest surface in each pixel of one or more views: its depth or its triangle.

Two ways to one result. On the GPUs measured, a compute pass takes a fraction of the rasteriser's time;
software adapters rasterise faster than they compute.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.gpu import ComputeProgram, Device, Frame, RasterProgram, make_texture
from dermis.rendering.geometry import HeadTextures
from dermis.rendering.projection import Matrix
from dermis.rendering.stages import SHARED_SHADERS, STAGES
from dermis.rendering.stages.variants import Variants

_TAKEN = 4  # triangles of a workgroup, in nearest.wgsl
_GROUPS_PER_ROW = 32768
_TILE = (32, 8)  # pixels that a workgroup of resolve_*.wgsl takes


@dataclass(frozen=True)
class Layers:
    """A texture array with a layer for each view, and what it takes to fill it.

    Even one view gets two layers: OpenGL takes a texture of one layer for no array.

    texture : depth (1 near, 0 nothing) as float, or triangle + 1 as uint
    depth : the rasteriser's depth attachments, one a layer, or one for all when triangles are wanted
    targets : the rasteriser's colour targets, one a layer
    nearness, found : the compute pass' buffers
    """

    texture: Any
    size: tuple[int, int]
    count: int
    depth: list[Any]
    targets: list[Any]
    nearness: Any = None
    found: Any = None


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
        self._finders = Variants(device, STAGES / "nearest.wgsl")
        if self._compute:
            resolve = "resolve_triangles.wgsl" if triangles else "resolve_depth.wgsl"
            self._resolve = ComputeProgram(device, STAGES / resolve, shared)
        target = "r32uint" if triangles else None
        self._raster = RasterProgram(
            device, STAGES / "nearest_raster.wgsl", shared, target=target, depth_compare="greater"
        )

    def make_layers(self, size: tuple[int, int], count: int) -> Layers:
        """Space for `count` views of size (width, height); those too large for a buffer are rasterised."""
        fits = 4 * size[0] * size[1] * count <= self._device.max_storage_bytes
        make = self._compute_layers if self._compute and fits else self._raster_layers
        return make(size, max(1, count))

    def draw(self, frame: Frame, stage: str, layers: Layers, clips: list[Matrix], head: HeadTextures) -> None:
        """Fill a layer for each matrix; depth 1 is near and 0 far."""
        if layers.nearness is not None:
            self._draw_compute(frame, stage, layers, clips, head)
        else:
            self._draw_raster(frame, stage, layers, clips, head)

    def _compute_layers(self, size: tuple[int, int], count: int) -> Layers:
        texel = "r32uint" if self._triangles else "r32float"
        texture = make_texture(self._device, size, texel, layers=max(2, count))
        words = np.zeros(size[0] * size[1] * count, np.uint32)
        nearness = self._device.buffer(words, "STORAGE")
        found = self._device.buffer(words if self._triangles else words[:1], "STORAGE")
        return Layers(texture, size, count, [], [], nearness, found)

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
        self, frame: Frame, stage: str, layers: Layers, clips: list[Matrix], head: HeadTextures
    ) -> None:
        views, places = _views_and_places(clips, layers.size)
        record = self._views(self._resolve, layers, views, head)
        record["sample"][: len(places), :2] = places
        record["reach"] = *places.min(axis=0), *places.max(axis=0)
        resources = {
            **head.resources,
            "views": record,
            "nearness": layers.nearness,
            "found": layers.found,
            "layers": layers.texture,
        }
        count = -(-head.triangles // _TAKEN)
        groups = (min(count, _GROUPS_PER_ROW), -(-count // _GROUPS_PER_ROW), len(views))
        for find in range(2 if self._triangles else 1):
            finder = self._finders.program((("FIND_TRIANGLE", find), ("SAMPLES", len(places))))
            frame.dispatch(stage, finder, resources, groups)
        across, down = (-(-side // tile) for side, tile in zip(layers.size, _TILE, strict=True))
        frame.dispatch(stage, self._resolve, resources, (across, down, layers.count))

    def _draw_raster(
        self, frame: Frame, stage: str, layers: Layers, clips: list[Matrix], head: HeadTextures
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

    def _views(self, program: Any, layers: Layers, clips: list[Matrix], head: HeadTextures) -> Any:
        record = program.record("Views", triangles=head.triangles)
        record["width"], record["height"] = layers.size
        record["clip"][: len(clips)] = np.swapaxes(np.array(clips, np.float32), 1, 2)
        return record


def _views_and_places(clips: list[Matrix], size: tuple[int, int]) -> tuple[list[Matrix], NDArray[np.float64]]:
    """One view and (n, 2) places in its pixels when the matrices differ by no more, else all views."""
    base, way = np.array(clips[0]), clips[0][3] / (clips[0][3] @ clips[0][3])
    moved = np.array(clips) - base
    shift = moved[:, :2] @ way
    apart = np.abs(moved[:, :2] - shift[..., None] * base[3]).max()
    if apart <= 1e-9 * (1.0 + np.abs(base).max()) and not moved[:, 2:].any():
        return clips[:1], 0.5 + shift * [-0.5, 0.5] * size
    return clips, np.full((1, 2), 0.5)
