"""Lower bounds ("floors") of stage times, derived from the bytes that a stage must read and write."""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np

from dermis.base.errors import refuse
from dermis.frame.features.diffusion.pyramid import Blur, PyramidLevels
from dermis.frame.features.surface.texels import SURFACE_TEXEL_BYTES
from dermis.frame.features.translucency.resources import Translucency
from dermis.frame.inputs import FrameInputs
from dermis.frame.techniques.gpu_gems_3 import StretchedLevels
from dermis.gpu import CommandList, ComputeProgram, Device, Texture, download, make_texture
from dermis.gpu.textures import TEXEL_FORMAT_BYTES, texel_bytes

_MAP_BINDINGS = ("colour_map", "slope_map", "relief_map", "specular_map", "roughness_map")
_TRIANGLE_BYTES, _VERTEX_BYTES = 16, 16  # in the buffers of triangles and of positions
_GUTTER_ENTRY_BYTES = 16
_SOURCE_INDEX_BYTES = 4  # of a source's index
_TEXELS_PER_BILINEAR_READ = 4  # texels read by bilinear interpolation
_COPIED_TEXTURE_SIDE, _COPIED_TEXTURE_SIDE_ON_CPU = 4096, 1024  # larger than caches
_COPIES_PER_PASS, _TIMED_REPEATS, _WARMUP_REPEATS = 8, 5, 20


@dataclass(frozen=True)
class FrameTraffic:
    """Inputs of a frame, and counts that determine its memory traffic.

    texels : number of atlas texels that show the surface
    head_pixels : number of pixels that show the head
    shadow_texels : number of texels of all shadow maps that show the head
    vertices : number of vertices of the mesh
    """

    inputs: FrameInputs
    texels: int
    head_pixels: int
    shadow_texels: int
    vertices: int


def frame_traffic(device: Device, inputs: FrameInputs, vertex_count: int) -> FrameTraffic:
    """Return the inputs of a drawn frame, with the counts on which the frame's memory traffic depends.

    vertex_count : number of vertices of the mesh
    """
    texels = np.count_nonzero(download(device, inputs.layouts[0].atlas.resources["atlas"])[..., 0])
    head_pixels = np.count_nonzero(download(device, inputs.resources.post.picture.bytes)[..., 3])
    maps, layers = inputs.resources.shadow_maps.texture, range(len(inputs.shadow_views.clips))
    shadow_texels = sum(int(np.count_nonzero(download(device, maps, layer=layer))) for layer in layers)
    return FrameTraffic(inputs, int(texels), int(head_pixels), shadow_texels, vertex_count)


def stage_bytes(traffic: FrameTraffic) -> dict[str, float]:
    """Return the least memory traffic of each stage: inputs read once and results written once [byte].

    Repeated reads, scratch data between passes, and tables that fit in caches are not counted. Neither are
    texels without a surface and pixels without the head, unless a stage needs them.
    """
    inputs, picture = traffic.inputs, traffic.inputs.resources.post.picture
    pixels, shadow = picture.size[0] * picture.size[1], inputs.resources.shadow_maps.texture
    samples = inputs.settings.samples * texel_bytes(inputs.resources.visibility.texture)
    geometry = _TRIANGLE_BYTES * inputs.resources.head.triangles + _VERTEX_BYTES * traffic.vertices
    shadow_bytes = len(inputs.shadow_views.clips) * texel_bytes(shadow)
    radiance = texel_bytes(picture.radiance)
    shaded = traffic.head_pixels * (shadow_bytes + texel_bytes(inputs.resources.scattered))
    shaded += _map_bytes(inputs, traffic.head_pixels)
    stages: dict[str, float] = {
        "shadows": traffic.shadow_texels * texel_bytes(shadow) + geometry,
        "visibility": traffic.head_pixels * samples + geometry,
        "shade": pixels * samples + shaded + pixels * radiance,
        "post": pixels * (radiance + texel_bytes(picture.exposed) + texel_bytes(picture.bytes)),
    }
    if interreflection := inputs.layouts[0].interreflection:
        stages["interreflection"] = float(interreflection.buffers.nbytes)
    return (stages | _scattering_bytes(traffic, shadow_bytes)) if inputs.blurs else stages


def _scattering_bytes(traffic: FrameTraffic, shadow_bytes: int) -> dict[str, float]:
    """Return the memory traffic of the stages that light the atlas and diffuse the light [byte].

    shadow_bytes : bytes read from all shadow maps for one texel of the atlas
    """
    inputs, texels, levels = traffic.inputs, traffic.texels, traffic.inputs.resources.diffusion.levels
    blur = inputs.blurs[0]
    entered = texels * TEXEL_FORMAT_BYTES[levels.texel_format]
    blurred = [texels * TEXEL_FORMAT_BYTES[levels.texel_format] / 4**halving for halving in blur.halvings[1:]]
    stages: dict[str, float] = {
        "irradiance": texels * (SURFACE_TEXEL_BYTES + shadow_bytes) + entered,
        "diffuse": entered + sum(blurred[:-1]) + sum(blurred) + _blur_surface_bytes(inputs, texels),
        "combine": sum(blurred) + texels * texel_bytes(inputs.resources.scattered),
    }
    if thin := inputs.layouts[0].translucency:
        stages["translucency"] = _translucency_bytes(thin, levels, blur)
        transmitted = thin.pairs.transmitted
        stages["combine"] += transmitted.size[0] * transmitted.size[1] * texel_bytes(transmitted)
    return stages


def _blur_surface_bytes(inputs: FrameInputs, texel_count: int) -> float:
    """Return the memory traffic of the blur passes, not counting the light itself [byte].

    The passes also read the stretch map (texels per millimetre) and the reach map (how far the chart extends
    from each texel), and fill the gutters. The passes of GPU Gems 3 use no reach map and no gutters, but also
    blur the stretch map.

    texel_count : number of atlas texels that show the surface
    """
    levels, finest, blur = inputs.resources.diffusion.levels, inputs.layouts[0].atlas, inputs.blurs[0]
    if isinstance(levels, StretchedLevels):
        stretch = texel_bytes(finest.resources["stretch_map"])
        return 2.0 * stretch * texel_count * len(blur.halvings[1:])
    atlases = (finest, *finest.coarser)
    traffic = 0.0
    for source, halving in pairwise(blur.halvings):
        maps = (atlases[halving].resources[name] for name in ("stretch_map", "reach_map"))
        traffic += sum(map(texel_bytes, maps)) * texel_count / 4**halving
        if blur.edge == "repeated" and (gutter := atlases[source].gutter):
            traffic += gutter.size * (1 + 2 * TEXEL_FORMAT_BYTES[levels.texel_format] / _GUTTER_ENTRY_BYTES)
    return traffic


def _translucency_bytes(translucency: Translucency, levels: PyramidLevels, blur: Blur) -> float:
    """Return the memory traffic of the stage that transmits light through thin parts of the head [byte].

    Light enters at source texels and leaves at receiver texels. The stage reads a list of weighted sources
    for each receiver, and the light at the sources. It writes the light at the receivers. If the
    transmittance depends on the direction of the light, it also reads positions and normals of the sources.
    """
    pairs, halving = translucency.pairs, blur.halvings[blur.profile_levels[1 + translucency.source_level]]
    receivers, sources = pairs.receivers[1], pairs.sources[1]
    lists = translucency.weights.size + pairs.receiver_ranges.size
    lists += (_SOURCE_INDEX_BYTES + SURFACE_TEXEL_BYTES * translucency.uses_tables) * sources
    level = (levels.size >> halving) ** 2
    source_texels = min(_TEXELS_PER_BILINEAR_READ * sources, level) * TEXEL_FORMAT_BYTES[levels.texel_format]
    return float(lists + source_texels + receivers * texel_bytes(translucency.pairs.transmitted))


def _map_bytes(inputs: FrameInputs, point_count: int) -> int:
    """Return a lower bound of the bytes read from the maps of a head to shade points.

    Of each map, one texel is counted for each point, but at most all texels of the map.

    point_count : number of points to shade
    """
    textures = [cast(Texture, inputs.bindings[name]) for name in _MAP_BINDINGS]
    return sum(texel_bytes(one) * min(point_count, one.size[0] * one.size[1]) for one in textures)


def copy_rate(device: Device) -> float:
    """Measure the memory bandwidth of copying a texture, counting both reads and writes [byte/s].

    Raises DermisError when the device has no timestamps.
    """
    software = device.adapter.kind == "CPU"
    side = _COPIED_TEXTURE_SIDE_ON_CPU if software else _COPIED_TEXTURE_SIDE
    program = ComputeProgram(device, Path(__file__).parent / "copy.wgsl")
    textures = [make_texture(device, (side, side), "rgba32float") for _ in range(2)]
    times = [
        _copy_ms(device, program, textures)
        for _ in range(_TIMED_REPEATS + (0 if software else _WARMUP_REPEATS))
    ]
    traffic = 2 * _COPIES_PER_PASS * side * side * texel_bytes(textures[0])
    return traffic / (1e-3 * statistics.median(times[-_TIMED_REPEATS:]))


def _copy_ms(device: Device, program: ComputeProgram, textures: list[Any]) -> float:
    """Return the device time of copying a texture back and forth several times [ms].

    textures : two textures of equal size
    """
    frame = CommandList(device)
    for source, target in (textures, textures[::-1]) * (_COPIES_PER_PASS // 2):
        frame.compute("copy", program, {"source": source, "destination": target}, source.size[:2])
    frame.submit()
    frame.wait()
    times = frame.stage_ms()
    if times is None:
        advice = "Choose another adapter, such as --adapter cpu"
        refuse(device.adapter.name, "timestamps of its passes", "it has none", advice)
    return times["total"]
