"""Texture-space diffusion by a hierarchy of Gaussians, stitched across the map's seams."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.diffusion import blur as diffuse
from dermis.frame.features.diffusion.kernels import lead_up
from dermis.frame.features.diffusion.pyramid import Blur, Levels
from dermis.frame.features.irradiance.irradiance import fine_levels
from dermis.frame.technique import ProfileSplit
from dermis.frame.techniques.technique import AtlasTechnique
from dermis.gpu import Recorder
from dermis.optics.gaussians import GaussianSum


class TextureSpace(AtlasTechnique):
    """The package's own technique [dEonLuebke2007]."""

    sources = ("dEonLuebke2007", "Geusebroek2003")
    transmits = True
    mixes = True

    def split(self, profile: GaussianSum, white: bool) -> ProfileSplit:
        """What is lit again, the Gaussians that blur, and what the picture adds to light on texels."""
        split = super().split(profile, white)
        relit_mm2 = float(profile.variance_mm2[0]) if self.relights(profile) else 0.0
        return replace(split, fine=fine_levels(split.blurred_mm2, split.weight, relit_mm2))

    def chain(
        self, split: ProfileSplit, atlas: AtlasTextures, edge: str
    ) -> tuple[ProfileSplit, tuple[int, ...]]:
        """The split with the levels between that make the blurs cheaper."""
        most = len(atlas.sheets(edge)) - 1
        variances, steps = lead_up(split.blurred_mm2, atlas.usual_per_mm, most)
        own = [k for k in range(len(variances)) if k + 1 not in steps]

        def led_up(one: ProfileSplit) -> ProfileSplit:
            weight = np.zeros((len(variances), 3))
            weight[own] = one.weight
            return replace(one, blurred_mm2=variances, weight=weight)

        return replace(led_up(split), others=tuple(map(led_up, split.others))), steps

    def fill(self, graph: Recorder, levels: Levels, atlas: AtlasTextures, blur: Blur) -> None:
        """Fill layer k with the light of layer 0 spread by the k-th Gaussian."""
        diffuse.draw(graph, levels, atlas, blur)


TECHNIQUE = TextureSpace()
