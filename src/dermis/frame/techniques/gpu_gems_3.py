"""The blurs of 2007 as the baseline to measure against: seven taps, halves, a blurred stretch map."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.diffusion.pyramid import Blur, Halvings, Levels, make_levels
from dermis.frame.programs import HALVES, program
from dermis.frame.technique import ProfileSplit
from dermis.frame.techniques.technique import AtlasTechnique
from dermis.gpu import (
    ComputeProgram,
    Constants,
    Device,
    FragmentProgram,
    MutableBindings,
    Recorder,
    TextureOrView,
    make_texture,
)
from dermis.gpu.textures import FORMAT_BYTES

Pair = tuple[TextureOrView, TextureOrView]


@dataclass(frozen=True, eq=False)
class StretchedLevels(Levels):
    """Levels with space for a stretch map that is blurred along with the light."""

    stretch: Pair | None = None


class GpuGems3(AtlasTechnique):
    """Twelve passes for six Gaussians."""

    sources = ("dEonLuebke2007",)
    stitches = False
    transmits = True

    def make_levels(self, device: Device, side: int, halvings: Halvings) -> Levels:
        """Space for light, its blurred levels and a blurred stretch map."""
        made = make_levels(device, side, halvings, HALVES)
        first, second = (make_texture(device, (side, side), HALVES) for _ in range(2))
        return StretchedLevels(made.stacks, made.first, made.scratch, side, HALVES, stretch=(first, second))

    def texel_bytes(self, levels: int) -> float:
        """Memory for each texel of the atlas."""
        return float(FORMAT_BYTES[HALVES] * (levels + 4))

    def halvings(self, split: ProfileSplit, atlas: AtlasTextures, edge: str) -> tuple[int, ...]:
        """All levels have the whole resolution."""
        return (0,) * (len(split.blurred_mm2) + 1)

    def fill(self, graph: Recorder, levels: Levels, atlas: AtlasTextures, blur: Blur) -> None:
        """Fill layer k with the light of layer 0 spread by the k-th Gaussian."""
        assert isinstance(levels, StretchedLevels) and levels.stretch is not None
        shaders = [
            self.shader(graph.device, (("AXIS", axis), ("SKIPPED", blur.edge == "skipped")))
            for axis in (0, 1)
        ]
        before, (stretch, spare) = 0.0, levels.stretch
        source: TextureOrView = atlas.resources["stretch_map"]
        for k, variance in enumerate(blur.variance_mm2, start=1):
            record = shaders[0].record(
                "Spread", sigma_mm=np.sqrt(variance - before), clear=blur.scale * np.asarray(blur.clear)
            )
            passes = (
                (levels.layer(k - 1), source, levels.spare(), spare),
                (levels.spare(), spare, levels.layer(k), stretch),
            )
            for shader, (light, wide, blurred, wider) in zip(shaders, passes, strict=True):
                linear = graph.device.sampler(mag_filter="linear", min_filter="linear")
                bound: MutableBindings = {
                    "spread": record,
                    "linear": linear,
                    "source": light,
                    "stretch": wide,
                }
                self.run(graph, shader, bound, (blurred, wider), levels.size)
            source, before = stretch, float(variance)

    def shader(self, device: Device, constants: Constants) -> ComputeProgram | FragmentProgram:
        """The pass along one axis."""
        return program(device, Path(__file__).with_name("gpu_gems_3.wgsl"), constants)

    def run(
        self,
        graph: Recorder,
        shader: ComputeProgram | FragmentProgram,
        bound: MutableBindings,
        into: Pair,
        side: int,
    ) -> None:
        """Declare one pass into a texture of light and one of stretch."""
        assert isinstance(shader, ComputeProgram)
        bound = bound | {"blurred": into[0], "stretch_blurred": into[1]}
        graph.compute("diffuse", shader, bound, (side, side))


TECHNIQUE = GpuGems3()
