"""The hierarchy of Gaussian blurs: each level from the one before, first along u, then along v."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.gpu import ComputeProgram, Device, Frame, make_texture
from dermis.gpu.textures import texture_from
from dermis.rendering.atlas_textures import AtlasTextures
from dermis.rendering.kernels import ROWS_PER_UNIT, TRUNCATION, WIDEST, kernel_table
from dermis.rendering.stages import STAGES
from dermis.rendering.stages.stitch import Stitch

EDGES = ("repeated", "cleared", "skipped")


@dataclass(frozen=True)
class Levels:
    """The blurred irradiance, layer 0 not blurred, and the space between two passes."""

    stack: Any
    views: list[Any]
    scratch: Any
    size: int


class Diffuse:
    """Spreads the light of layer 0 to the layers above it."""

    name = "diffuse"

    def __init__(self, device: Device) -> None:
        self._device = device
        self._stitch = Stitch(device)
        self._path = STAGES / "diffuse.wgsl"
        self._made: dict[tuple[bool, str], list[ComputeProgram]] = {}
        self._kernels = texture_from(device, kernel_table(), "r32float")

    def make_levels(self, size: int, count: int) -> Levels:
        """Space for the unblurred light and `count` blurred levels."""
        stack = make_texture(self._device, (size, size), "rgba32float", layers=max(2, count + 1))
        views = layer_views(stack, count + 1)
        return Levels(stack, views, make_texture(self._device, (size, size), "rgba32float"), size)

    def draw(
        self,
        frame: Frame,
        levels: Levels,
        atlas: AtlasTextures,
        variance_mm2: NDArray[np.float64],
        edge: str = "repeated",
        clear: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        """Fill layer k with the light spread by variance_mm2[k - 1] (increasing).

        edge : one of EDGES, what lies beyond a chart's edge and its apron
        clear : the light that empty texels show when the edge is "cleared"
        """
        along = self._along(atlas.sheared, edge)
        before = 0.0
        for k, variance in enumerate(variance_mm2, start=1):
            self._stitch.draw(frame, "diffuse", atlas, levels.views[k - 1], levels.scratch)
            added = {"variance_mm2": variance - before, "before_mm2": before}
            record = along[0].record("Spread", **added, clear=clear)
            passes = ((levels.views[k - 1], levels.scratch), (levels.scratch, levels.views[k]))
            for program, (source, blurred) in zip(along, passes, strict=True):
                bound = {
                    **atlas.resources,
                    "spread": record,
                    "source": source,
                    "kernel_table": self._kernels,
                    "blurred": blurred,
                }
                frame.compute("diffuse", program, bound, (levels.size, levels.size))
            before = float(variance)

    def _along(self, sheared: bool, edge: str) -> list[ComputeProgram]:
        """The passes along u and along v, made when first asked for."""
        if (sheared, edge) not in self._made:
            table = {"ROWS_PER_UNIT": ROWS_PER_UNIT, "WIDEST": WIDEST, "TRUNCATION": TRUNCATION}
            chosen = {**table, "SHEARED": sheared, "EDGE": EDGES.index(edge)}
            self._made[sheared, edge] = [
                ComputeProgram(self._device, self._path, constants={"AXIS": axis, **chosen})
                for axis in (0, 1)
            ]
        return self._made[sheared, edge]


def layer_views(stack: Any, count: int) -> list[Any]:
    """Views of the first `count` layers of a texture array, each by itself."""
    options = {"dimension": "2d", "array_layer_count": 1}
    return [stack.create_view(base_array_layer=k, **options) for k in range(count)]
