"""The hierarchy of Gaussian blurs: each level from the one before, first along u, then along v."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.frame.atlas_textures import AtlasTextures
from dermis.frame.gaussian_kernels import (
    NARROW,
    ROWS_PER_UNIT,
    SUMMED_TRUNCATION,
    TRUNCATION,
    WIDEST,
    kernel_table,
)
from dermis.frame.levels import FLOATS, Levels, halvings_of, make_levels
from dermis.frame.passes import SOURCE_SHADERS, STAGES, STORE_SHADERS, TILE
from dermis.frame.passes.stitch import Stitch
from dermis.gpu import ComputeProgram, Device, Frame
from dermis.gpu.textures import texture_from

EDGES = ("repeated", "cleared", "skipped")
# Variance that a halved resolution adds: the mean of four texels, and reading between such means [texel^2].
_AVERAGED, _READ = 1 / 16, 3 / 16


class Diffuse:
    """Spreads the light that enters to the layers above it.

    texel : format of the levels; when left out halves on GPUs, which read them faster, and floats on software
        adapters, which convert halves one by one
    """

    name = "diffuse"

    def __init__(self, device: Device, texel: str | None = None) -> None:
        self._device = device
        self.texel = texel or (FLOATS if device.adapter.kind == "CPU" else "rgba16float")
        self._stitch = Stitch(device, self.texel)
        self._made: dict[tuple[bool, str], list[ComputeProgram]] = {}
        table = kernel_table()
        self._kernels = texture_from(device, np.dstack([table[:-1], table[1:]]), "rg32float")
        self._linear = device.sampler(mag_filter="linear", min_filter="linear")
        self._halve = self._program("diffuse_halve.wgsl")

    def make_levels(self, size: int, count: int) -> Levels:
        """Space for the unblurred light and `count` blurred levels."""
        return make_levels(self._device, size, count, self.texel)

    def draw(
        self,
        frame: Frame,
        levels: Levels,
        atlas: AtlasTextures,
        variance_mm2: NDArray[np.float64],
        edge: str = "repeated",
        clear: ArrayLike = (0.0, 0.0, 0.0),
        scale: float = 1.0,
    ) -> None:
        """Fill layer k with the light spread by variance_mm2[k - 1] (increasing).

        edge : one of EDGES, what lies beyond a chart's edge and its gutter
        clear : the light that empty texels show when the edge is "cleared"
        scale : what light is multiplied with in the layers
        """
        sheets = (atlas, *(atlas.coarser if edge == "repeated" else ()))
        levels.halvings = halvings_of(variance_mm2, atlas.usual_per_mm, len(sheets) - 1)
        levels.scale = scale
        source = levels.layer(0)
        first = np.sqrt(variance_mm2[0]) * atlas.usual_per_mm  # [texel]
        alone = len(variance_mm2) == 1 or first > NARROW
        for k, added in enumerate(_added(variance_mm2, levels.halvings), start=1):
            finer, here = levels.halvings[k - 1 : k + 1]
            self._stitch.draw(frame, "diffuse", sheets[finer], source)
            if here > finer:
                source = self._halved(frame, levels, source, k - 1)
            for along, blurred in zip(
                self._along(atlas.sheared, edge),
                (levels.spare(here), levels.layer(k, here)),
                strict=True,
            ):
                cut = TRUNCATION if alone and k == 1 else SUMMED_TRUNCATION
                spread = along.record("Spread", truncation=cut, clear=scale * np.asarray(clear), **added)
                bound = {"spread": spread, "kernel_table": self._kernels, "source": source, "stored": blurred}
                self._run(frame, along, sheets[here].resources | bound, levels.size >> here)
                source = blurred

    def _halved(self, frame: Frame, levels: Levels, source: Any, k: int) -> Any:
        """Layer k at half its resolution."""
        times = levels.halvings[k] + 1
        bound = {"source": source, "stored": levels.layer(k, times)}
        self._run(frame, self._halve, bound, levels.size >> times)
        return bound["stored"]

    def _run(self, frame: Frame, program: ComputeProgram, bound: dict[str, Any], side: int) -> None:
        frame.compute("diffuse", program, bound | {"linear": self._linear}, (side, side), TILE)

    def _along(self, sheared: bool, edge: str) -> list[ComputeProgram]:
        """The passes along u and along v, made when first asked for."""
        if (sheared, edge) not in self._made:
            table = {"ROWS_PER_UNIT": ROWS_PER_UNIT, "WIDEST": WIDEST}
            chosen = {**table, "SHEARED": sheared, "EDGE": EDGES.index(edge)}
            passes = [self._program("diffuse.wgsl", {"AXIS": axis, **chosen}) for axis in (0, 1)]
            self._made[sheared, edge] = passes
        return self._made[sheared, edge]

    def _program(self, name: str, constants: dict[str, float] | None = None) -> ComputeProgram:
        shaders = SOURCE_SHADERS[self.texel], STORE_SHADERS[self.texel]
        return ComputeProgram(self._device, STAGES / name, shaders, constants)


def _added(variance_mm2: NDArray[np.float64], halvings: tuple[int, ...]) -> Iterator[dict[str, float]]:
    """What each level adds to the one before, and halving to both, as the shader's struct Spread has it."""
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
