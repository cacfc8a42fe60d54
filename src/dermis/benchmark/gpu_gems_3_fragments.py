"""The passes of 2007 in the graphics pipeline, as they were drawn then: a baseline to measure against."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dermis.frame.geometry import mesh_constants
from dermis.frame.levels import FLOATS, Levels
from dermis.frame.passes import SHARED_SHADERS, STAGES
from dermis.frame.passes.combine import Combine
from dermis.frame.passes.gpu_gems_3 import TEXEL, Pair, Published
from dermis.frame.passes.irradiance import Irradiance
from dermis.frame.passes.surface_texels import SurfaceTexels
from dermis.frame.passes.variants import Constants
from dermis.gpu import Device, FragmentProgram, Frame, make_texture
from dermis.optics.gaussians import MOST_GAUSSIANS

if TYPE_CHECKING:
    from dermis.frame.frame import Stages

_FOLDER = Path(__file__).parent


@contextmanager
def published_as_fragments(device: Device, stages: Stages) -> Iterator[None]:
    """While it lasts, frames of the technique "gpu-gems-3" light the atlas, blur and add up in render passes.

    The results are those of compute up to the rounding of halves. Other techniques cannot be drawn meanwhile.
    """
    usual = stages.irradiance, stages.published, stages.combine
    drawn = FragmentIrradiance(device), FragmentBlurs(device), FragmentSum(device)
    stages.irradiance, stages.published, stages.combine = drawn
    try:
        yield
    finally:
        stages.irradiance, stages.published, stages.combine = usual


class FragmentIrradiance(Irradiance):
    """Lights each texel of the atlas; all levels of this technique have one format."""

    def __init__(self, device: Device) -> None:
        self._device, self._surfaces = device, SurfaceTexels(device)
        self._programs: dict[Constants, FragmentProgram] = {}

    def _program(self, constants: Constants, texel: str) -> Any:
        if constants not in self._programs:
            path, chosen = (
                _FOLDER / "gpu_gems_3_irradiance.wgsl",
                dict(constants + mesh_constants(self._device)),
            )
            program = FragmentProgram(self._device, path, (SHARED_SHADERS,), chosen, targets=[texel])
            self._programs[constants] = program
        return self._programs[constants]

    def _run(self, frame: Frame, program: Any, bound: dict[str, Any], into: Any, side: int) -> None:
        frame.fill("irradiance", program, bound, [into])


class FragmentBlurs(Published):
    """Spreads light in two passes for each Gaussian; each fills a texture of light and one of stretch."""

    name = "published as fragments"

    def __init__(self, device: Device) -> None:
        self._device = device
        self._made = {}

    def make_levels(self, size: int, count: int) -> Levels:
        """Space for the light that enters and `count` blurred levels, all of it halves."""
        layers = max(2, count + 1)
        stack = make_texture(self._device, (size, size), TEXEL, layers=layers, use="raster")
        scratch, *stretch = (make_texture(self._device, (size, size), TEXEL, use="raster") for _ in range(3))
        views = tuple(texture.create_view() for texture in stretch)
        return Levels(stack, scratch, size, TEXEL, (0,) * (count + 1), stretch=views)

    def _run(self, frame: Frame, program: Any, bound: dict[str, Any], into: Pair, side: int) -> None:
        frame.fill("diffuse", program, bound, into)

    def _program(self, constants: dict[str, float]) -> FragmentProgram:
        path = _FOLDER / "gpu_gems_3_fragment.wgsl"
        return FragmentProgram(self._device, path, (STAGES,), constants, targets=[TEXEL, TEXEL])


class FragmentSum(Combine):
    """Adds the levels up, and what comes through thin parts."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._nothing = make_texture(device, (1, 1), FLOATS, use="map")
        self._sum = FragmentProgram(
            device, _FOLDER / "gpu_gems_3_sum.wgsl", (SHARED_SHADERS,), targets=[FLOATS]
        )

    def make_sum(self, side: int) -> Any:
        """Space for the sum."""
        return make_texture(self._device, (side, side), FLOATS, use="raster")

    def draw(
        self, frame: Frame, levels: Levels, weight: NDArray[np.float64], into: Any, transmitted: Any = None
    ) -> None:
        """As `Combine.draw` does, of levels that all have the whole resolution."""
        padded = np.zeros((MOST_GAUSSIANS, 4), np.float32)
        padded[: len(weight), :3] = weight / levels.scale
        padded[0, 3] = 1.0
        through = transmitted is not None
        bound = {
            "weights": self._sum.record("Weights", count=len(weight), through=through, weight=padded),
            "levels": levels.stack,
            "transmitted": transmitted if through else self._nothing,
        }
        frame.fill("combine", self._sum, bound, [into])
