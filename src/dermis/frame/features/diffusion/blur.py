"""The hierarchy of Gaussian blurs: each level from the one before, first along u, then along v."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.atlas.passes import draw_gutters
from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.diffusion.kernels import (
    NARROW,
    ROWS_PER_UNIT,
    SUMMED_TRUNCATION,
    TRUNCATION,
    WIDEST,
    kernel_table,
)
from dermis.frame.features.diffusion.pyramid import Blur, Levels
from dermis.frame.programs import TILE, program
from dermis.gpu import ComputeProgram, Device, MutableBindings, Recorder, Texture, TextureOrView
from dermis.gpu.textures import texture_from

EDGES = ("repeated", "cleared", "skipped")
# Variance that halving the resolution adds: averaging four texels, and interpolating the means [texel^2].
_AVERAGED, _READ = 1 / 16, 3 / 16


def draw(graph: Recorder, levels: Levels, atlas: AtlasTextures, blur: Blur) -> None:
    """Fill layer k with the light of layer 0 spread by blur.variance_mm2[k - 1]."""
    variance_mm2, sheets = blur.variance_mm2, atlas.sheets(blur.edge)
    source: TextureOrView = levels.layer(0)
    first = np.sqrt(variance_mm2[0]) * atlas.usual_per_mm  # [texel]
    alone = len(variance_mm2) == 1 or first > NARROW
    for k, added in enumerate(_added(variance_mm2, blur.halvings), start=1):
        finer, here = blur.halvings[k - 1 : k + 1]
        draw_gutters(graph, "diffuse", sheets[finer], source, levels.texel)
        if here > finer:
            source = _halved(graph, levels, source, k - 1, here)
        far = k > 1 and k - 1 in blur.steps and k not in blur.steps  # most of its width comes at once
        cut = TRUNCATION if far or (alone and k == 1) else SUMMED_TRUNCATION
        clear = blur.scale * np.asarray(blur.clear)
        for axis, blurred in enumerate((levels.spare(here), levels.layer(k, here))):
            along = _along(graph.device, levels.texel, axis, atlas.sheared, blur.edge)
            spread = along.record("Spread", truncation=cut, clear=clear, **added)
            bound: MutableBindings = {**sheets[here].resources, "source": source, "stored": blurred}
            bound |= {"spread": spread, "kernel_table": _kernel_texture(graph.device)}
            _run(graph, along, bound, levels.size >> here)
            source = blurred


def _halved(graph: Recorder, levels: Levels, source: TextureOrView, k: int, times: int) -> TextureOrView:
    """Layer k at half its resolution."""
    into = levels.layer(k, times)
    halve = program(graph.device, "diffusion/diffuse_halve.wgsl", (), levels.texel, levels.texel)
    _run(graph, halve, {"source": source, "stored": into}, levels.size >> times)
    return into


def _run(graph: Recorder, shader: ComputeProgram, bound: MutableBindings, side: int) -> None:
    linear = graph.device.sampler(mag_filter="linear", min_filter="linear")
    graph.compute("diffuse", shader, bound | {"linear": linear}, (side, side), TILE)


def _along(device: Device, texel: str, axis: int, sheared: bool, edge: str) -> ComputeProgram:
    """The pass along u (axis 0) or along v."""
    table = (("ROWS_PER_UNIT", ROWS_PER_UNIT), ("WIDEST", WIDEST))
    chosen = (("AXIS", axis), *table, ("SHEARED", sheared), ("EDGE", EDGES.index(edge)))
    return program(device, "diffusion/diffuse.wgsl", chosen, texel, texel)


def _kernel_texture(device: Device) -> Texture:
    def make() -> Texture:
        table = kernel_table()
        return texture_from(device, np.dstack([table[:-1], table[1:]]), "rg32float")

    return device.shared("kernels", make)


def _added(variance_mm2: NDArray[np.float64], halvings: tuple[int, ...]) -> Iterator[dict[str, float]]:
    """Members of the shader's `Spread`: variance that levels add to the one before, and halving to both."""
    before = owed = paid = 0.0
    for variance, (finer, here) in zip(variance_mm2, pairwise(halvings), strict=True):
        halved = _AVERAGED + _READ if here > finer else 0.0
        yield {
            "variance_mm2": variance - before,
            "before_mm2": before,
            "resampled": halved,
            "to_come": sum(_READ / 4**times for times in range(here)),
            "owed": owed / 4 ** (here - finer),
            "paid_mm2": paid,
        }
        owed, paid, before = halved, variance - before, float(variance)
