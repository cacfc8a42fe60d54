"""The bytes that each stage must move, and how fast memory moves them: a lower bound of its time."""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np

from dermis.base.errors import DermisError
from dermis.frame.features.diffusion.pyramid import Blur, PyramidLevels
from dermis.frame.features.surface.texels import SURFACE_BYTES
from dermis.frame.features.translucency.resources import Translucency
from dermis.frame.inputs import FrameInputs
from dermis.frame.techniques.gpu_gems_3 import StretchedLevels
from dermis.gpu import CommandList, ComputeProgram, Device, Texture, download, make_texture
from dermis.gpu.textures import FORMAT_BYTES, texel_bytes

_MAPS = ("colour_map", "slope_map", "relief_map", "specular_map", "roughness_map")
_TRIANGLE_BYTES, _VERTEX_BYTES = 16, 16  # bytes of a triangle's corners and of a vertex' position in the tables
_GUTTER_ENTRY_BYTES = 16  # bytes of a texel in the list of a gutter
_INDEX_BYTES = 4  # bytes of where a source is
_BILINEAR_TEXELS = 4  # texels that a lookup between texels reads
_SIDE, _SIDE_ON_CPU = 4096, 1024  # beyond what caches hold
_COPIES, _REPEATS, _WARMUP_REPEATS = 8, 5, 20


@dataclass(frozen=True)
class FrameTraffic:
    """A frame's inputs, and how much of them there is.

    texels : of the atlas that show the surface
    seen : pixels that show the head
    shadowing : texels of all shadow maps that show it
    vertices : of the mesh
    """

    inputs: FrameInputs
    texels: int
    seen: int
    shadowing: int
    vertices: int


def frame_traffic(device: Device, inputs: FrameInputs, vertices: int) -> FrameTraffic:
    """Return the counts after a frame was drawn."""
    texels = np.count_nonzero(download(device, inputs.layouts[0].atlas.resources["atlas"])[..., 0])
    seen = np.count_nonzero(download(device, inputs.resources.post.picture.bytes)[..., 3])
    maps, layers = inputs.resources.shadow_maps.texture, range(len(inputs.shadow_views.clips))
    shadowing = sum(int(np.count_nonzero(download(device, maps, layer=layer))) for layer in layers)
    return FrameTraffic(inputs, int(texels), int(seen), shadowing, vertices)


def stage_bytes(moved: FrameTraffic) -> dict[str, float]:
    """Return bytes by stage: inputs read once and results written once, in the formats in use.

    Where others are not needed, only texels with surface and pixels that show the head count. Repeated reads
    within a stage or a blur, scratch space between two passes, and tables that fit in caches do not count.
    """
    inputs, picture = moved.inputs, moved.inputs.resources.post.picture
    pixels, shadow = picture.size[0] * picture.size[1], inputs.resources.shadow_maps.texture
    samples = inputs.settings.samples * texel_bytes(inputs.resources.visibility.texture)
    geometry = _TRIANGLE_BYTES * inputs.resources.head.triangles + _VERTEX_BYTES * moved.vertices
    looked_up = len(inputs.shadow_views.clips) * texel_bytes(shadow)
    radiance = texel_bytes(picture.radiance)
    shaded = moved.seen * (looked_up + texel_bytes(inputs.resources.scattered)) + _map_bytes(inputs, moved.seen)
    found: dict[str, float] = {
        "shadows": moved.shadowing * texel_bytes(shadow) + geometry,
        "visibility": moved.seen * samples + geometry,
        "shade": pixels * samples + shaded + pixels * radiance,
        "post": pixels * (radiance + texel_bytes(picture.exposed) + texel_bytes(picture.bytes)),
    }
    if between := inputs.layouts[0].interreflection:
        found["interreflection"] = float(between.buffers.nbytes)
    return (found | _scattering_bytes(moved, looked_up)) if inputs.blurs else found


def _scattering_bytes(moved: FrameTraffic, looked_up: int) -> dict[str, float]:
    """Return bytes of the stages that light the atlas and spread the light."""
    inputs, texels, levels = moved.inputs, moved.texels, moved.inputs.resources.diffusion.levels
    blur = inputs.blurs[0]
    entered = texels * FORMAT_BYTES[levels.texel]
    blurred = [texels * FORMAT_BYTES[levels.texel] / 4**halved for halved in blur.halvings[1:]]
    found: dict[str, float] = {
        "irradiance": texels * (SURFACE_BYTES + looked_up) + entered,
        "diffuse": entered + sum(blurred[:-1]) + sum(blurred) + _blur_surface_bytes(inputs, texels),
        "combine": sum(blurred) + texels * texel_bytes(inputs.resources.scattered),
    }
    if thin := inputs.layouts[0].translucency:
        found["translucency"] = _translucency_bytes(thin, levels, blur)
        found["combine"] += thin.pairs.transmitted.size[0] * thin.pairs.transmitted.size[1] * texel_bytes(thin.pairs.transmitted)
    return found


def _blur_surface_bytes(inputs: FrameInputs, texels: int) -> float:
    """Return bytes that blurs read of the surface: stretch, the extent of the chart, and gutters.

    The passes of 2007 blur the stretch map along with the light instead.
    """
    levels, finest, blur = inputs.resources.diffusion.levels, inputs.layouts[0].atlas, inputs.blurs[0]
    if isinstance(levels, StretchedLevels):
        stretch = texel_bytes(finest.resources["stretch_map"])
        return 2.0 * stretch * texels * len(blur.halvings[1:])
    sheets = (finest, *finest.coarser)
    moved = 0.0
    for source, halved in pairwise(blur.halvings):
        maps = (sheets[halved].resources[name] for name in ("stretch_map", "reach_map"))
        moved += sum(map(texel_bytes, maps)) * texels / 4**halved
        if blur.edge == "repeated" and (gutter := sheets[source].gutter):
            moved += gutter.size * (1 + 2 * FORMAT_BYTES[levels.texel] / _GUTTER_ENTRY_BYTES)
    return moved


def _translucency_bytes(thin: Translucency, levels: PyramidLevels, blur: Blur) -> float:
    """Bytes of translucency: pairs and their texels, the light of the sources, and the light that leaves.

    Slabs ask for the light at the sources by its direction too, so for the surface there.
    """
    pairs, halved = thin.pairs, blur.halvings[blur.profile_levels[1 + thin.source_level]]
    receivers, sources = pairs.receivers[1], pairs.sources[1]
    lists = thin.weights.size + pairs.receiver_ranges.size + (_INDEX_BYTES + SURFACE_BYTES * thin.uses_tables) * sources
    level = (levels.size >> halved) ** 2
    read = min(_BILINEAR_TEXELS * sources, level) * FORMAT_BYTES[levels.texel]
    return float(lists + read + receivers * texel_bytes(thin.pairs.transmitted))


def _map_bytes(inputs: FrameInputs, most: int) -> int:
    """Return bytes of the head's maps that `most` points read, a texel each."""
    textures = [cast(Texture, inputs.bindings[name]) for name in _MAPS]
    return sum(texel_bytes(one) * min(most, one.size[0] * one.size[1]) for one in textures)


def copy_rate(device: Device) -> float:
    """Return the median rate of reading and writing in a pass that copies a texture [byte/s].

    Raises DermisError when the device has no timestamps.
    """
    software = device.adapter.kind == "CPU"
    side = _SIDE_ON_CPU if software else _SIDE
    program = ComputeProgram(device, Path(__file__).parent / "copy.wgsl")
    textures = [make_texture(device, (side, side), "rgba32float") for _ in range(2)]
    times = [_copy(device, program, textures) for _ in range(_REPEATS + (0 if software else _WARMUP_REPEATS))]
    moved = 2 * _COPIES * side * side * texel_bytes(textures[0])
    return moved / (1e-3 * statistics.median(times[-_REPEATS:]))


def _copy(device: Device, program: ComputeProgram, textures: list[Any]) -> float:
    """Return the time of copying back and forth [ms]."""
    frame, (one, other) = CommandList(device), textures
    for source, copied in ((one, other), (other, one)) * (_COPIES // 2):
        frame.compute("copy", program, {"source": source, "copied": copied}, one.size[:2])
    frame.submit()
    frame.wait()
    times = frame.stage_ms()
    if times is None:
        raise DermisError(
            f"{device.adapter.name}: expected timestamps of its passes, but it has none. "
            "Choose another adapter, such as --adapter cpu."
        )
    return times["total"]
