"""The published blurs as the baseline to measure against: seven taps, halves, a blurred stretch map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.gpu import ComputeProgram, Device, Frame, make_texture
from dermis.rendering.atlas_textures import AtlasTextures
from dermis.rendering.stages import STAGES
from dermis.rendering.stages.diffuse import Levels, layer_views

_TEXEL = "rgba16float"


class Published:
    """Spreads the light of layer 0 to the layers above it, in twelve passes for six Gaussians."""

    name = "published"

    def __init__(self, device: Device) -> None:
        self._device = device
        path = STAGES / "published.wgsl"
        self._along = [ComputeProgram(device, path, constants={"AXIS": axis}) for axis in (0, 1)]
        self._halve = ComputeProgram(device, STAGES / "published_halves.wgsl")
        self._stretch: list[Any] = []

    def make_levels(self, size: int, count: int) -> Levels:
        """Space for the unblurred light, as floats, and `count` blurred levels."""
        stack = make_texture(self._device, (size, size), _TEXEL, layers=max(2, count + 1))
        light = make_texture(self._device, (size, size), "rgba32float")
        return Levels(
            stack,
            [light, *layer_views(stack, count + 1)[1:]],
            make_texture(self._device, (size, size), _TEXEL),
            size,
        )

    def draw(
        self,
        frame: Frame,
        levels: Levels,
        atlas: AtlasTextures,
        variance_mm2: NDArray[np.float64],
        edge: str = "cleared",
        clear: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        """Fill layer k with the light spread by variance_mm2[k - 1] (increasing).

        edge : there is only one: empty texels show the light `clear`
        """
        sampler = self._device.sampler(mag_filter="linear", min_filter="linear")
        stretch, spare = self._stretch_maps(levels.size)
        (first,) = layer_views(levels.stack, 1)
        size = (levels.size, levels.size)
        frame.compute("diffuse", self._halve, {"light": levels.views[0], "halves": first}, size)
        light_levels = [first, *levels.views[1:]]
        source, before = atlas.resources["stretch_map"], 0.0
        for k, variance in enumerate(variance_mm2, start=1):
            record = self._along[0].record("Spread", sigma_mm=np.sqrt(variance - before), clear=clear)
            passes = (
                (light_levels[k - 1], source, levels.scratch, spare),
                (levels.scratch, spare, light_levels[k], stretch),
            )
            for program, (light, wide, blurred, wider) in zip(self._along, passes, strict=True):
                bound = {"spread": record, "linear": sampler, "source": light, "stretch": wide}
                bound |= {"blurred": blurred, "stretch_blurred": wider}
                frame.compute("diffuse", program, bound, size)
            source, before = stretch, float(variance)

    def _stretch_maps(self, size: int) -> list[Any]:
        """Space for the stretch map blurred along both axes, and along one."""
        if not self._stretch or self._stretch[0].size[0] != size:
            self._stretch = [make_texture(self._device, (size, size), _TEXEL) for _ in range(2)]
        return self._stretch
