"""The bytes that each stage must move, whatever it computes: what memory alone allows."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dermis.frame.atlas_layout import Translucency
from dermis.frame.inputs import Inputs
from dermis.frame.levels import Blur, Levels
from dermis.frame.passes.surface_texels import SURFACE_BYTES
from dermis.frame.techniques.gpu_gems_3 import StretchedLevels
from dermis.gpu import Device, download
from dermis.gpu.textures import texel_bytes

_MAPS = ("colour_map", "slope_map", "relief_map", "specular_map", "roughness_map")
_CORNERS, _PLACE = 16, 16  # bytes of a triangle's corners and of a vertex' position in the tables
_APRON = 16  # bytes of a texel in the list of an gutter
_BILINEAR = 4  # texels that one place between texels reads


@dataclass(frozen=True)
class Moved:
    """What a frame has to do with.

    texels : of the atlas that show the surface
    seen : pixels that show something
    shadowing : texels of all shadow maps that do
    vertices : of the mesh
    """

    inputs: Inputs
    texels: int
    seen: int
    shadowing: int
    vertices: int


def moved_by(device: Device, inputs: Inputs, vertices: int) -> Moved:
    """Counts after a frame was drawn."""
    texels = np.count_nonzero(download(device, inputs.layouts[0].atlas.resources["atlas"])[..., 0])
    seen = np.count_nonzero(download(device, inputs.resources.picture.bytes)[..., 3])
    maps, layers = inputs.resources.shadow_maps.texture, range(len(inputs.shadow_views.clips))
    shadowing = sum(int(np.count_nonzero(download(device, maps, layer=layer))) for layer in layers)
    return Moved(inputs, int(texels), int(seen), shadowing, vertices)


def stage_bytes(moved: Moved) -> dict[str, float]:
    """Bytes by stage: what it needs read once, what it makes written once, in the formats that are used.

    Only texels with surface and pixels that show something count where no others are needed. What is read
    again within a stage or a blur, scratch space between two passes, and tables that stay in caches do not.
    """
    inputs, picture = moved.inputs, moved.inputs.resources.picture
    pixels, shadow = picture.size[0] * picture.size[1], inputs.resources.shadow_maps.texture
    samples = inputs.settings.samples * texel_bytes(inputs.resources.visibility.texture)
    geometry = _CORNERS * inputs.resources.head.triangles + _PLACE * moved.vertices
    looked_up = len(inputs.shadow_views.clips) * texel_bytes(shadow)
    radiance = texel_bytes(picture.radiance)
    shaded = moved.seen * (looked_up + texel_bytes(inputs.resources.scattered)) + _maps(inputs, moved.seen)
    found: dict[str, float] = {
        "shadows": moved.shadowing * texel_bytes(shadow) + geometry,
        "visibility": moved.seen * samples + geometry,
        "shade": pixels * samples + shaded + pixels * radiance,
        "post": pixels * (radiance + texel_bytes(picture.exposed) + texel_bytes(picture.bytes)),
    }
    return (found | _scattering_bytes(moved, looked_up)) if inputs.resources.scatters else found


def _scattering_bytes(moved: Moved, looked_up: int) -> dict[str, float]:
    """Of the stages that light the atlas and spread the light."""
    inputs, texels, levels = moved.inputs, moved.texels, moved.inputs.resources.levels
    blur = inputs.blurs[0]
    entered = texels * texel_bytes(levels.stack)
    blurred = [texels * texel_bytes(levels.stack) / 4**halved for halved in blur.halvings[1:]]
    found: dict[str, float] = {
        "irradiance": texels * (SURFACE_BYTES + looked_up) + entered,
        "diffuse": entered + sum(blurred[:-1]) + sum(blurred) + _surface_of_blurs(inputs, texels),
        "combine": sum(blurred) + texels * texel_bytes(inputs.resources.scattered),
    }
    if thin := inputs.layouts[0].translucency:
        found["translucency"] = _through(thin, levels, blur)
        found["combine"] += thin.light.size[0] * thin.light.size[1] * texel_bytes(thin.light)
    return found


def _surface_of_blurs(inputs: Inputs, texels: int) -> float:
    """What each blur must know of the surface: stretch, how far the chart reaches, and gutters.

    The passes of 2007 blur a stretch map along instead, which makes another one for each Gaussian.
    """
    levels, finest, blur = inputs.resources.levels, inputs.layouts[0].atlas, inputs.blurs[0]
    if isinstance(levels, StretchedLevels):
        stretch = texel_bytes(finest.resources["stretch_map"])
        return 2.0 * stretch * texels * len(blur.halvings[1:])
    sheets = (finest, *finest.coarser)
    moved = 0.0
    for source, halved in pairwise(blur.halvings):
        moved += texel_bytes(sheets[halved].resources["sheet_map"]) * texels / 4**halved
        if blur.edge == "repeated" and (gutter := sheets[source].gutter):
            moved += gutter.size * (1 + 2 * texel_bytes(levels.stack) / _APRON)
    return moved


def _through(thin: Translucency, levels: Levels, blur: Blur) -> float:
    """Bytes of what comes through: pairs and their places read, the light of the sources, and what leaves."""
    pairs, halved = thin.pairs, blur.halvings[1 + thin.layer]
    lists = sum(buffer.size for buffer in (thin.weights, pairs.sources, pairs.receivers))
    level = (levels.size >> halved) ** 2
    read = min(_BILINEAR * pairs.source_count, level) * texel_bytes(levels.stack)
    return float(lists + read + pairs.receiver_count * texel_bytes(thin.light))


def _maps(inputs: Inputs, most: int) -> int:
    """Bytes of the head's maps that `most` places read, each at least a texel."""
    textures = [inputs.lit[name] for name in _MAPS]
    return sum(texel_bytes(one) * min(most, one.size[0] * one.size[1]) for one in textures)
