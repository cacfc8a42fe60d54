"""Passes of GPU Gems 3 (2007) in the graphics pipeline, as a baseline for benchmarks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dermis.frame.features.atlas import passes as atlas_passes
from dermis.frame.features.atlas.lit_atlas import LitAtlas
from dermis.frame.features.diffusion.combine import placeholder_light
from dermis.frame.features.diffusion.pyramid import Blur, Halvings, PyramidLevels
from dermis.frame.features.surface import texels as surface_texels
from dermis.frame.features.translucency import passes as translucency
from dermis.frame.inputs import FrameInputs
from dermis.frame.programs import (
    FLOAT_TEXEL_FORMAT,
    HALF_TEXEL_FORMAT,
    program_constants,
    registry_version,
    shader_folders,
)
from dermis.frame.techniques.gpu_gems_3 import GpuGems3, StretchedLevels, TexturePair
from dermis.gpu import (
    ComputeProgram,
    Constants,
    Device,
    Graph,
    MutableBindings,
    Recorder,
    RenderProgram,
    Texture,
    TextureOrView,
    cached_program,
    make_texture,
)
from dermis.optics.gaussians import MAX_GAUSSIANS

_SHADER_FOLDER = Path(__file__).parent


class FragmentPasses(GpuGems3):
    """Technique of GPU Gems 3 with render passes instead of compute passes.

    Its results differ from those of `GpuGems3` by rounding to half precision only.
    """

    def make_levels(self, device: Device, atlas_side: int, halvings: Halvings) -> PyramidLevels:
        """Return textures for the irradiance and the pyramid levels, all in half precision.

        atlas_side : side of the atlas [texel]
        halvings : for each atlas layout, the number of times that the resolution of each level is halved;
            only the number of levels is used
        """
        count = max(map(len, halvings))
        stack = make_texture(
            device, (atlas_side, atlas_side), HALF_TEXEL_FORMAT, layer_count=count, content_source="raster"
        )
        scratch, *stretch = (
            make_texture(device, (atlas_side, atlas_side), HALF_TEXEL_FORMAT, content_source="raster")
            for _ in range(3)
        )
        first, second = (texture.create_view() for texture in stretch)
        return StretchedLevels(
            (stack,), (0,), scratch, atlas_side, HALF_TEXEL_FORMAT, stretch=(first, second)
        )

    def make_exitance_texture(self, device: Device, atlas_side: int) -> Texture:
        """Return the texture for the weighted sum of the pyramid levels."""
        return make_texture(device, (atlas_side, atlas_side), FLOAT_TEXEL_FORMAT, content_source="raster")

    def scatter(self, graph: Graph, inputs: FrameInputs) -> Texture:
        """Record the passes that light the atlas, blur the light and sum the levels; return the sum."""
        resources = inputs.resources
        levels = resources.diffusion.levels
        for layout, blur in zip(inputs.layouts, inputs.blurs, strict=True):
            graph.add_replayable(atlas_passes.draw_stretch, layout.head, layout.atlas)
            surface_texels.draw(graph, layout)
            self._light_atlas(graph, layout, inputs.light_constants, levels.layer(0), blur.scale)
            self.blur_levels(graph, levels, layout.atlas, blur)
            thin = layout.translucency
            if thin:
                translucency.draw_weights(graph, thin)
                if thin.uses_tables:
                    translucency.draw_direction_factors(graph, layout, thin, inputs.light_constants)
            transmitted = translucency.draw(graph, levels, blur, thin) if thin else None
            lost = thin.pairs.lost if thin else None
            self._sum_levels(graph, levels, blur, layout.scattered, transmitted, lost)
        return resources.scattered

    def blur_program(self, device: Device, constants: Constants) -> RenderProgram:
        """Return the render program of a blur along one axis.

        constants : pipeline constants of the shader
        """
        return _fragment_program(
            device, "gpu_gems_3_fragment.wgsl", constants, [HALF_TEXEL_FORMAT, HALF_TEXEL_FORMAT]
        )

    def draw_blur(
        self,
        graph: Recorder,
        shader: ComputeProgram | RenderProgram,
        shader_resources: MutableBindings,
        target_pair: TexturePair,
        atlas_side: int,
    ) -> None:
        """Record the render pass of a blur along one axis.

        shader : render program from `blur_program`
        shader_resources : resources that the shader reads
        target_pair : textures for the blurred light and for the blurred stretch map
        atlas_side : ignored
        """
        assert isinstance(graph, Graph) and isinstance(shader, RenderProgram)
        graph.draw_fullscreen("diffuse", shader, shader_resources, target_pair)

    def _light_atlas(
        self,
        graph: Graph,
        layout: LitAtlas,
        constants: Constants,
        target_texture: TextureOrView,
        radiance_scale: float,
    ) -> None:
        shader = _fragment_program(graph.device, "gpu_gems_3_irradiance.wgsl", constants, [HALF_TEXEL_FORMAT])
        entering = shader.make_record("Entering", scale=radiance_scale)
        bound = {**layout.bindings, "surfaces": layout.surfaces, "entering": entering}
        graph.draw_fullscreen("irradiance", shader, bound, [target_texture])

    def _sum_levels(
        self,
        graph: Graph,
        levels: PyramidLevels,
        blur: Blur,
        target_texture: Texture,
        transmitted_light: Texture | None,
        lost_light: Texture | None,
    ) -> None:
        shader = _fragment_program(graph.device, "gpu_gems_3_sum.wgsl", (), [FLOAT_TEXEL_FORMAT])
        padded = np.zeros((MAX_GAUSSIANS, 4), np.float32)
        padded[: len(blur.weight), :3] = blur.weight / blur.scale
        padded[0, 3] = 1.0
        counts = {"count": len(blur.weight), "through": transmitted_light is not None}
        bound: MutableBindings = {
            "weights": shader.make_record("Weights", weight=padded, **counts),
            "levels": levels.stacks[0],
            "transmitted": placeholder_light(graph.device)
            if transmitted_light is None
            else transmitted_light,
            "lost": placeholder_light(graph.device) if lost_light is None else lost_light,
        }
        graph.draw_fullscreen("combine", shader, bound, [target_texture])


def _fragment_program(
    device: Device, shader_name: str, constants: Constants, target_formats: list[str]
) -> RenderProgram:
    def make_program() -> RenderProgram:
        path, folders = _SHADER_FOLDER / shader_name, shader_folders()
        all_constants = program_constants(device, path, folders, constants)
        return RenderProgram(device, path, folders, all_constants, targets=target_formats)

    return cached_program(device, (shader_name, registry_version()), constants, make_program)


FRAGMENT_PASSES = FragmentPasses()
