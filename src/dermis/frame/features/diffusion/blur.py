"""Passes that fill the blur pyramid: each level is the previous level, blurred along u and then along v."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.atlas.passes import draw_gutters
from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.diffusion.kernels import (
    CHAINED_TRUNCATION_SIGMAS,
    KERNEL_TRUNCATION_SIGMAS,
    MAX_CHAINED_SIGMA_TEXELS,
    MAX_TABLE_VARIANCE,
    ROWS_PER_UNIT_VARIANCE,
    kernel_ratio_table,
)
from dermis.frame.features.diffusion.pyramid import Blur, PyramidLevels
from dermis.frame.programs import TILE_SIDE, program
from dermis.gpu import ComputeProgram, Device, MutableBindings, Recorder, Texture, TextureOrView
from dermis.gpu.textures import texture_from_array

CHART_EDGE_MODES = ("repeated", "cleared", "skipped")
# Variance that halving the resolution adds: averaging four texels, and interpolating the means [texel^2].
_AVERAGING_VARIANCE, _INTERPOLATION_VARIANCE = 1 / 16, 3 / 16


def draw(graph: Recorder, levels: PyramidLevels, atlas: AtlasTextures, blur: Blur) -> None:
    """Declare the passes that fill each level k with level 0, blurred by the k-th Gaussian of `blur`."""
    variance_mm2, sheets = blur.variance_mm2, atlas.mips_for_blurs(blur.edge)
    source: TextureOrView = levels.layer(0)
    first_deviation = np.sqrt(variance_mm2[0]) * atlas.median_texels_per_mm  # [texel]
    full_first = len(variance_mm2) == 1 or first_deviation > MAX_CHAINED_SIGMA_TEXELS
    for k, members in enumerate(_level_variance_members(variance_mm2, blur.halvings), start=1):
        source_halvings, halvings = blur.halvings[k - 1 : k + 1]
        draw_gutters(graph, "diffuse", sheets[source_halvings], source, levels.texel_format)
        if halvings > source_halvings:
            source = _draw_halved_level(graph, levels, source, k - 1, halvings)
        # The level after an intermediate one gains most of its width in one blur.
        wide = k > 1 and k - 1 in blur.intermediate_levels and k not in blur.intermediate_levels
        truncation = (
            KERNEL_TRUNCATION_SIGMAS if wide or (full_first and k == 1) else CHAINED_TRUNCATION_SIGMAS
        )
        clear = blur.scale * np.asarray(blur.clear)
        for axis, blurred in enumerate((levels.scratch_view(halvings), levels.layer(k, halvings))):
            shader = _axis_program(graph.device, levels.texel_format, axis, atlas.sheared, blur.edge)
            spread = shader.make_record("Spread", truncation=truncation, clear=clear, **members)
            bindings: MutableBindings = {**sheets[halvings].resources, "source": source, "stored": blurred}
            bindings |= {"spread": spread, "kernel_table": _kernel_texture(graph.device)}
            _dispatch_over_level(graph, shader, bindings, levels.size >> halvings)
            source = blurred


def _draw_halved_level(
    graph: Recorder, levels: PyramidLevels, finer_level: TextureOrView, level_index: int, halvings: int
) -> TextureOrView:
    """Declare the pass that stores a copy of a level at half its resolution; return a view of the copy.

    finer_level : view of the level at the finer resolution
    level_index : index of the level
    halvings : number of halvings from full resolution to the resolution of the copy
    """
    halved = levels.layer(level_index, halvings)
    shader = program(
        graph.device, "diffusion/diffuse_halve.wgsl", (), levels.texel_format, levels.texel_format
    )
    _dispatch_over_level(graph, shader, {"source": finer_level, "stored": halved}, levels.size >> halvings)
    return halved


def _dispatch_over_level(
    graph: Recorder, shader: ComputeProgram, bindings: MutableBindings, level_side: int
) -> None:
    linear = graph.device.sampler(mag_filter="linear", min_filter="linear")
    graph.compute("diffuse", shader, bindings | {"linear": linear}, (level_side, level_side), TILE_SIDE)


def _axis_program(
    device: Device, texel_format: str, axis: int, sheared: bool, edge_mode: str
) -> ComputeProgram:
    """Return the program that blurs along one axis of the atlas.

    texel_format : texture format of the levels
    axis : 0 for u, 1 for v
    sheared : whether to account for an angle between u and v that is not a right angle
    edge_mode : how blurs treat texels beyond a chart, see `Blur.edge`
    """
    table = (("ROWS_PER_UNIT", ROWS_PER_UNIT_VARIANCE), ("MAX_TABLE_VARIANCE", MAX_TABLE_VARIANCE))
    constants = (("AXIS", axis), *table, ("SHEARED", sheared), ("EDGE", CHART_EDGE_MODES.index(edge_mode)))
    return program(device, "diffusion/diffuse.wgsl", constants, texel_format, texel_format)


def _kernel_texture(device: Device) -> Texture:
    def upload_table() -> Texture:
        table = kernel_ratio_table()
        return texture_from_array(device, np.dstack([table[:-1], table[1:]]), "rg32float")

    return device.cached("kernels", upload_table)


def _level_variance_members(
    variance_mm2: NDArray[np.float64], halvings: tuple[int, ...]
) -> Iterator[dict[str, float]]:
    """Yield the members of the shader struct `Spread` for each blurred level.

    The members are the variance that the blur of the level adds, and the variances that resampling adds.

    variance_mm2 : (k,) increasing variances of the blurred levels [mm^2]
    halvings : (k + 1,) number of times that the resolution of each level is halved; level 0 is unblurred
    """
    source_mm2 = previous_resampling = previous_mm2 = 0.0
    for variance, (source_halvings, level_halvings) in zip(variance_mm2, pairwise(halvings), strict=True):
        halved = level_halvings > source_halvings
        resampling = _AVERAGING_VARIANCE + _INTERPOLATION_VARIANCE if halved else 0.0
        yield {
            "variance_mm2": variance - source_mm2,
            "source_mm2": source_mm2,
            "resampling": resampling,
            "pending": sum(_INTERPOLATION_VARIANCE / 4**times for times in range(level_halvings)),
            "previous_resampling": previous_resampling / 4 ** (level_halvings - source_halvings),
            "previous_mm2": previous_mm2,
        }
        previous_resampling, previous_mm2 = resampling, variance - source_mm2
        source_mm2 = float(variance)
