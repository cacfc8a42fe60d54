"""Texture-space diffusion by a pyramid of Gaussian blurs, which carry light across the seams of the atlas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.diffusion import blur as diffuse
from dermis.frame.features.diffusion.kernels import add_intermediate_levels
from dermis.frame.features.diffusion.pyramid import Blur, PyramidLevels
from dermis.frame.features.irradiance.irradiance import subtexel_light_members
from dermis.frame.technique import ProfileSplit
from dermis.frame.techniques.technique import AtlasTechnique
from dermis.gpu import Recorder
from dermis.optics.gaussians import GaussianSum


class TextureSpace(AtlasTechnique):
    """Texture-space diffusion [dEonLuebke2007], the default technique."""

    sources = ("dEonLuebke2007", "Geusebroek2003")
    supports_translucency = True
    mixes_profiles = True

    def split_profile(self, profile: GaussianSum, normalise_weights: bool) -> ProfileSplit:
        """Split a profile into its narrowest Gaussian and the Gaussians that blur light.

        The narrowest Gaussian is not blurred: its share of the light leaves the skin where it enters, and is
        computed at each pixel. If even this Gaussian is too wide for that, light is blurred with all
        Gaussians of the profile. The field `fine` of the result holds the values with which the shader
        corrects light that varies within a texel.

        normalise_weights : whether to scale the weights of each channel to a sum of 1, so that only the
            colour map sets the albedo
        """
        split = super().split_profile(profile, normalise_weights)
        unblurred_mm2 = float(profile.variance_mm2[0]) if self.leaves_narrowest_unblurred(profile) else 0.0
        return replace(split, fine=subtexel_light_members(split.blurred_mm2, split.weight, unblurred_mm2))

    def add_intermediate_levels(
        self, split: ProfileSplit, atlas: AtlasTextures, edge_mode: str
    ) -> tuple[ProfileSplit, tuple[int, ...]]:
        """Insert intermediate levels of weight 0 into the blur pyramid, to make the chain of blurs cheaper.

        Return the new split of the profile, and the indices of the inserted levels.

        split : split of the profile; its Gaussians blur the light of the levels
        atlas : textures of the atlas
        edge_mode : what blurs read beyond the edge of a chart, one of `blur.CHART_EDGE_MODES`
        """
        max_halvings = len(atlas.mips_for_blurs(edge_mode)) - 1
        variances, steps = add_intermediate_levels(
            split.blurred_mm2, atlas.median_texels_per_mm, max_halvings
        )
        own = [k for k in range(len(variances)) if k + 1 not in steps]

        def with_intermediate_levels(profile_split: ProfileSplit) -> ProfileSplit:
            weight = np.zeros((len(variances), 3))
            weight[own] = profile_split.weight
            return replace(profile_split, blurred_mm2=variances, weight=weight)

        return replace(
            with_intermediate_levels(split), others=tuple(map(with_intermediate_levels, split.others))
        ), steps

    def blur_levels(self, graph: Recorder, levels: PyramidLevels, atlas: AtlasTextures, blur: Blur) -> None:
        """Declare the passes that fill each level k with level 0, blurred by the k-th Gaussian."""
        diffuse.draw(graph, levels, atlas, blur)


TECHNIQUE = TextureSpace()
