"""Texture-space diffusion as published in GPU Gems 3 (2007), the baseline for comparisons.

The technique blurs with seven taps and half floats, and blurs the stretch map together with the light.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.diffusion.pyramid import Blur, Halvings, PyramidLevels, make_levels
from dermis.frame.programs import HALF_TEXEL_FORMAT, program
from dermis.frame.technique import ProfileSplit
from dermis.frame.techniques.technique import AtlasTechnique
from dermis.gpu import (
    ComputeProgram,
    Constants,
    Device,
    MutableBindings,
    Recorder,
    RenderProgram,
    TextureOrView,
    make_texture,
)
from dermis.gpu.textures import TEXEL_FORMAT_BYTES

TexturePair = tuple[TextureOrView, TextureOrView]


@dataclass(frozen=True, eq=False)
class StretchedLevels(PyramidLevels):
    """Textures of the blur pyramid, and of a stretch map that is blurred together with the light.

    The stretch map holds the texel density on the surface along u and along v.

    stretch : blurred stretch map, and the stretch map that is blurred only along u
    """

    stretch: TexturePair | None = None


class GpuGems3(AtlasTechnique):
    """Texture-space diffusion as published in 2007, with two blur passes for each Gaussian."""

    sources = ("dEonLuebke2007",)
    stitches_seams = False
    supports_translucency = True

    def make_levels(self, device: Device, atlas_side: int, halvings: Halvings) -> PyramidLevels:
        """Create textures for light, its blurred levels and a blurred stretch map.

        atlas_side : side of the atlas [texels]
        halvings : for each atlas layout, the number of times that the resolution of each level is halved
        """
        pyramid = make_levels(device, atlas_side, halvings, HALF_TEXEL_FORMAT)
        first, second = (make_texture(device, (atlas_side, atlas_side), HALF_TEXEL_FORMAT) for _ in range(2))
        return StretchedLevels(
            pyramid.stacks,
            pyramid.first,
            pyramid.scratch,
            atlas_side,
            HALF_TEXEL_FORMAT,
            stretch=(first, second),
        )

    def texel_bytes(self, blur_count: int) -> float:
        """Return the memory per atlas texel of the pyramid levels and the blurred stretch map [bytes]."""
        return float(TEXEL_FORMAT_BYTES[HALF_TEXEL_FORMAT] * (blur_count + 4))

    def level_halvings(self, split: ProfileSplit, atlas: AtlasTextures, edge_mode: str) -> tuple[int, ...]:
        """Return the number of halvings of each level's resolution: 0, as all levels have full resolution."""
        return (0,) * (len(split.blurred_mm2) + 1)

    def blur_levels(self, graph: Recorder, levels: PyramidLevels, atlas: AtlasTextures, blur: Blur) -> None:
        """Declare the passes that fill each level k with level 0, blurred by the k-th Gaussian."""
        assert isinstance(levels, StretchedLevels) and levels.stretch is not None
        shaders = [
            self.blur_program(graph.device, (("AXIS", axis), ("SKIPPED", blur.edge == "skipped")))
            for axis in (0, 1)
        ]
        before, (stretch, spare) = 0.0, levels.stretch
        source: TextureOrView = atlas.resources["stretch_map"]
        for k, variance in enumerate(blur.variance_mm2, start=1):
            record = shaders[0].make_record(
                "Spread", sigma_mm=np.sqrt(variance - before), clear=blur.scale * np.asarray(blur.clear)
            )
            passes = (
                (levels.layer(k - 1), source, levels.scratch_view(), spare),
                (levels.scratch_view(), spare, levels.layer(k), stretch),
            )
            for shader, (light, stretch_source, blurred, stretch_blurred) in zip(
                shaders, passes, strict=True
            ):
                linear = graph.device.sampler(mag_filter="linear", min_filter="linear")
                bound: MutableBindings = {
                    "spread": record,
                    "linear": linear,
                    "source": light,
                    "stretch": stretch_source,
                }
                self.draw_blur(graph, shader, bound, (blurred, stretch_blurred), levels.size)
            source, before = stretch, float(variance)

    def blur_program(self, device: Device, constants: Constants) -> ComputeProgram | RenderProgram:
        """Return the program that blurs light and the stretch map along one axis.

        constants : pipeline constants that select the axis, and whether empty texels are skipped
        """
        return program(device, Path(__file__).with_name("gpu_gems_3.wgsl"), constants)

    def draw_blur(
        self,
        graph: Recorder,
        shader: ComputeProgram | RenderProgram,
        shader_resources: MutableBindings,
        target_pair: TexturePair,
        atlas_side: int,
    ) -> None:
        """Declare one blur pass, which writes blurred light and the blurred stretch map.

        shader : result of `blur_program`
        shader_resources : resources that the shader reads
        target_pair : textures for blurred light and for the blurred stretch map
        atlas_side : side of the atlas [texels]
        """
        assert isinstance(shader, ComputeProgram)
        shader_resources = shader_resources | {"blurred": target_pair[0], "stretch_blurred": target_pair[1]}
        graph.compute("diffuse", shader, shader_resources, (atlas_side, atlas_side))


TECHNIQUE = GpuGems3()
