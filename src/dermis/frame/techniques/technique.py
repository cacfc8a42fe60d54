"""Base classes of scattering techniques: one without scattering, one that diffuses light over the atlas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dermis.frame.features.atlas import gutters
from dermis.frame.features.atlas.passes import draw_blend, draw_stretch
from dermis.frame.features.atlas.textures import MAX_ATLAS_HALVINGS, AtlasTextures
from dermis.frame.features.diffusion import combine
from dermis.frame.features.diffusion import mixture as mix
from dermis.frame.features.diffusion.mixture import ProfileMixture
from dermis.frame.features.diffusion.pyramid import (
    Blur,
    Halvings,
    PyramidLevels,
    choose_halvings,
    make_levels,
)
from dermis.frame.features.irradiance import irradiance
from dermis.frame.features.irradiance.irradiance import LIGHT_FILTER_SIGMA_TEXELS
from dermis.frame.features.surface import texels
from dermis.frame.features.translucency import passes as translucency
from dermis.frame.features.translucency.resources import Translucency
from dermis.frame.inputs import FrameInputs
from dermis.frame.programs import FLOAT_TEXEL_FORMAT, level_format
from dermis.frame.technique import ProfileSplit, TechniqueResources, TechniqueTraits, channel_weights
from dermis.gpu import ComputeProgram, Device, Graph, Memo, Recorder, Texture, TextureOrView, UniformRecord
from dermis.gpu.textures import TEXEL_FORMAT_BYTES
from dermis.optics.gaussians import GaussianSum
from dermis.scene.settings import Settings

# Narrower Gaussians are finer than texels and pores: their light is computed in the picture, not blurred.
_MAX_UNBLURRED_VARIANCE_MM2 = 0.1**2


class Technique(TechniqueTraits):
    """Technique that computes subsurface scattering; in this base class, all light leaves where it enters.

    The name of a technique is its key in `dermis.scene.techniques.TECHNIQUES`.

    Examples
    --------
    >>> from dermis.scene.techniques import TECHNIQUES
    >>> TECHNIQUES["texture-space"].uses_atlas, TECHNIQUES["none"].uses_atlas
    (True, False)
    """

    def make_levels(self, device: Device, atlas_side: int, halvings: Halvings) -> PyramidLevels:
        """Create the textures of the blur pyramid.

        Techniques that blur no light over the atlas get the smallest possible textures.

        atlas_side : side of the atlas [texels]
        halvings : for each atlas layout, the number of times that the resolution of each level is halved
        """
        return make_levels(device, atlas_side, halvings, FLOAT_TEXEL_FORMAT)

    def make_exitance_texture(self, device: Device, atlas_side: int) -> Texture:
        """Create the square texture for the exitance of scattered light, as large as the atlas."""
        return combine.make_blur_sum(device, atlas_side)

    def add_intermediate_levels(
        self, split: ProfileSplit, atlas: AtlasTextures, edge_mode: str
    ) -> tuple[ProfileSplit, tuple[int, ...]]:
        """Insert intermediate levels of weight 0 into the blur pyramid, to make the chain of blurs cheaper.

        Return the new split of the profile, and the indices of the inserted levels. This base class inserts
        none.

        split : split of the profile; its Gaussians blur the light of the levels
        atlas : textures of the atlas
        edge_mode : what blurs read beyond the edge of a chart, one of `blur.CHART_EDGE_MODES`
        """
        return split, ()

    def level_halvings(self, split: ProfileSplit, atlas: AtlasTextures, edge_mode: str) -> tuple[int, ...]:
        """Return how many times the resolution of each level is halved; level 0 is the unblurred light.

        split : split of the profile; its Gaussians blur the light of the levels
        atlas : textures of the atlas
        edge_mode : what blurs read beyond the edge of a chart, one of `blur.CHART_EDGE_MODES`
        """
        return (0,) * (1 + len(split.blurred_mm2))

    def make_resources(
        self, memo: Memo, device: Device, settings: Settings, profile: GaussianSum
    ) -> TechniqueResources | None:
        """Return the tables and textures of the technique from the cache `memo`, None if there are none."""
        return None

    def make_subsurface_layers(
        self, memo: Memo, device: Device, settings: Settings
    ) -> TechniqueResources | None:
        """Return textures for subsurface light that is diffused separately from the light of the picture.

        The output "diffuse" needs them if the technique diffuses light over the pixels of the picture. The
        result is None for all other techniques.
        """
        return None

    def write_view_record(
        self, view: UniformRecord, shade: ComputeProgram, resources: TechniqueResources | None
    ) -> None:
        """Write the members of the shading record that only this technique reads.

        view : uniform record of the shading pass
        shade : program of the shading pass
        resources : result of `make_resources`
        """

    def subsurface_layers(self, resources: TechniqueResources | None) -> Texture | None:
        """Return the texture to which shading writes subsurface light, None to add it to the picture."""
        return None

    def scatter(self, graph: Graph, inputs: FrameInputs) -> Texture:
        """Declare the passes before shading, and return the texture that shading reads as `scattered`.

        The texture holds the exitance of scattered light over the atlas, unless the technique stores other
        data in it.
        """
        return inputs.resources.scattered

    def add_subsurface_light(self, graph: Graph, inputs: FrameInputs, radiance: Texture) -> Texture:
        """Declare the passes after shading, and return the texture of the radiance of the picture."""
        return radiance

    def blur_subsurface_layers(
        self, graph: Graph, inputs: FrameInputs
    ) -> tuple[TextureOrView, TextureOrView]:
        """Declare the passes that diffuse the light in the textures of `make_subsurface_layers`.

        Return textures of the diffused light, and of the fraction of this light that leaves the skin towards
        the camera.
        """
        raise NotImplementedError

    def sum_translucency(
        self, graph: Graph, inputs: FrameInputs, atlas_textures: tuple[Texture, ...]
    ) -> Texture:
        """Declare the passes that compute only the light through thin parts of the head, over the atlas.

        The result serves outputs that separate this light from the rest of the picture.

        Return the texture of the only layout or, if there are two layouts, the texture of their blend.

        atlas_textures : textures that the passes fill: one for each atlas layout and, if there are two
            layouts, one for their blend
        """
        raise NotImplementedError


class AtlasTechnique(Technique):
    """Technique that lights the atlas, blurs the light with each Gaussian, and sums the blurred levels."""

    uses_atlas = True

    def gaussians(self, profile: GaussianSum) -> GaussianSum:
        """Return the Gaussians that replace a profile in this technique; here the profile itself."""
        return profile

    def leaves_narrowest_unblurred(self, profile: GaussianSum) -> bool:
        """Return whether the narrowest Gaussian is so narrow that light need not be blurred with it.

        Its share of the light is then computed at each pixel of the picture instead.
        """
        return bool(profile.variance_mm2[0] <= _MAX_UNBLURRED_VARIANCE_MM2)

    def split_profile(self, profile: GaussianSum, normalise_weights: bool) -> ProfileSplit:
        """Split a profile into its narrowest Gaussian and the Gaussians that blur light.

        The narrowest Gaussian is not blurred: its share of the light leaves the skin where it enters, and is
        computed at each pixel. If even this Gaussian is too wide for that, light is blurred with all
        Gaussians of the profile.

        normalise_weights : whether to scale the weights of each channel to a sum of 1, so that only the
            colour map sets the albedo
        """
        profile = self.gaussians(profile)
        weight = channel_weights(profile, normalise_weights)
        total = weight.sum(axis=0)
        if self.leaves_narrowest_unblurred(profile):
            return ProfileSplit(weight[0], total, profile.variance_mm2[1:], weight[1:])
        return ProfileSplit(np.zeros(3), total, profile.variance_mm2, weight)

    def make_levels(self, device: Device, atlas_side: int, halvings: Halvings) -> PyramidLevels:
        """Create the textures of the blur pyramid in the format that is fastest on the device.

        atlas_side : side of the atlas [texels]
        halvings : for each atlas layout, the number of times that the resolution of each level is halved
        """
        return make_levels(device, atlas_side, halvings, level_format(device))

    def texel_bytes(self, blur_count: int) -> float:
        """Return the peak memory of blurs per texel of the atlas, including temporary textures [bytes].

        The estimate is for software adapters, which store blurred light in full precision.

        blur_count : number of Gaussians that blur light
        """
        mips = sum(0.25**halving for halving in range(MAX_ATLAS_HALVINGS + 1))
        return TEXEL_FORMAT_BYTES[FLOAT_TEXEL_FORMAT] * (
            blur_count + 2 * mips
        )  # upper bound, as if no level were halved

    def level_halvings(self, split: ProfileSplit, atlas: AtlasTextures, edge_mode: str) -> tuple[int, ...]:
        """Return how many times the resolution of each level is halved; level 0 is the unblurred light.

        split : split of the profile; its Gaussians blur the light of the levels
        atlas : textures of the atlas
        edge_mode : what blurs read beyond the edge of a chart, one of `blur.CHART_EDGE_MODES`
        """
        max_halvings = len(atlas.mips_for_blurs(edge_mode)) - 1
        return choose_halvings(split.blurred_mm2, atlas.median_texels_per_mm, max_halvings)

    def scatter(self, graph: Graph, inputs: FrameInputs) -> Texture:
        """Declare the passes that light the atlas, blur the light and sum the blurred levels.

        If there are two atlas layouts, a last pass blends them. Return the texture of the exitance.
        """
        resources = inputs.resources
        levels, layouts, mixture = resources.diffusion.levels, inputs.layouts, resources.diffusion.mixture
        if not inputs.blurs:
            return resources.scattered
        for index, (layout, blur) in enumerate(zip(layouts, inputs.blurs, strict=True)):
            into = levels.layer(0), levels.size, levels.texel_format, blur.scale, LIGHT_FILTER_SIGMA_TEXELS
            graph.add_replayable(draw_stretch, layout.head, layout.atlas)
            if layout.gutter_update:
                graph.add_replayable(
                    gutters.draw, layout.atlas, layout.gutter_update.tracing, layout.gutter_update.head
                )
            texels.draw(graph, layout)
            irradiance.draw(graph, layout, inputs.light_constants, *into)
            if layout.translucency:
                graph.add_replayable(translucency.draw_weights, layout.translucency)
                if layout.translucency.uses_tables:
                    translucency.draw_direction_factors(
                        graph, layout, layout.translucency, inputs.light_constants
                    )
            graph.add_replayable(self.blur_levels, levels, layout.atlas, blur)
            target = mixture.sum_layer(0) if mixture else layout.scattered
            graph.add_replayable(self.sum_exitance, levels, blur, layout.translucency, target)
            if mixture:
                mix.draw_blend_weights(graph, layout, mixture, index)
                graph.add_replayable(
                    self.add_other_profiles, levels, blur, layout.atlas, mixture, index, layout.scattered
                )
        if len(layouts) > 1:
            draw_blend(graph, layouts[0], layouts[1], resources.scattered)
        return resources.scattered

    def blur_levels(self, graph: Recorder, levels: PyramidLevels, atlas: AtlasTextures, blur: Blur) -> None:
        """Declare the passes that fill each level k with level 0, blurred by the k-th Gaussian."""
        raise NotImplementedError

    def sum_exitance(
        self,
        graph: Recorder,
        levels: PyramidLevels,
        blur: Blur,
        thin_parts: Translucency | None,
        exitance_texture: TextureOrView,
    ) -> None:
        """Declare the passes that compute the exitance: the weighted sum of the blurred levels.

        Light through thin parts of the head is added to the sum.

        levels : textures of the blurred levels
        blur : Gaussians of the blur, with their weights
        thin_parts : resources of the light through thin parts of the head, None if the scene has no such
            light
        exitance_texture : texture to which the exitance is written
        """
        through = translucency.draw(graph, levels, blur, thin_parts) if thin_parts else None
        combine.draw(
            graph, levels, blur, exitance_texture, through, thin_parts.pairs.lost if thin_parts else None
        )

    def add_other_profiles(
        self,
        graph: Recorder,
        levels: PyramidLevels,
        blur: Blur,
        atlas: AtlasTextures,
        mixture: ProfileMixture,
        layout_index: int,
        exitance_texture: Texture,
    ) -> None:
        """Declare the passes that compute the exitance of skin in which a map blends several profiles.

        For light that enters at one point and leaves at another point, each profile is weighted by the mean
        of its blend weights at the two points. Light transport is therefore reciprocal.

        levels : textures of the blurred levels
        blur : Gaussians of the blur, with their weights
        atlas : textures of the atlas
        mixture : resources for the blend, among them the exitance of the first profile alone
        layout_index : index of the atlas layout
        exitance_texture : texture to which the exitance of the blend is written
        """
        for other, (entering, weight) in enumerate(
            zip(mixture.entering_light, blur.weight_differences, strict=True)
        ):
            change = replace(blur, weight=weight)
            combine.draw(graph, levels, change, mixture.sum_layer(1 + 2 * other))
            mix.draw_entering_light(graph, levels, mixture, layout_index, other)
            self.blur_levels(graph, entering, atlas, blur)
            combine.draw(graph, entering, change, mixture.sum_layer(2 + 2 * other))
        mix.draw(graph, mixture, layout_index, exitance_texture)

    def sum_translucency(
        self, graph: Graph, inputs: FrameInputs, atlas_textures: tuple[Texture, ...]
    ) -> Texture:
        """Declare the passes that compute only the light through thin parts of the head, over the atlas.

        The blurred levels get weights of 0, so that they contribute no light.

        Return the texture of the only layout or, if there are two layouts, the texture of their blend.

        atlas_textures : textures that the passes fill: one for each atlas layout and, if there are two
            layouts, one for their blend
        """
        layouts, levels = inputs.layouts, inputs.resources.diffusion.levels
        for layout, blur, texture in zip(layouts, inputs.blurs, atlas_textures, strict=False):
            unblurred, thin = replace(blur, weight=np.zeros_like(blur.weight)), layout.translucency
            assert thin is not None
            combine.draw(graph, levels, unblurred, texture, thin.pairs.transmitted, thin.pairs.lost)
        if len(layouts) > 1:
            first, second = (replace(layout, scattered=atlas_textures[k]) for k, layout in enumerate(layouts))
            draw_blend(graph, first, second, atlas_textures[-1])
        return atlas_textures[-1]
