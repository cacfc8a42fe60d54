"""The interface of scattering techniques, and the base of those that diffuse light over the atlas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dermis.frame.features.atlas import gutters
from dermis.frame.features.atlas.passes import draw_blend, draw_stretch
from dermis.frame.features.atlas.textures import MOST_HALVINGS, AtlasTextures
from dermis.frame.features.diffusion import combine
from dermis.frame.features.diffusion import mixture as mix
from dermis.frame.features.diffusion.pyramid import Blur, Halvings, Levels, halvings_of, make_levels
from dermis.frame.features.diffusion.mixture import Mixture
from dermis.frame.features.irradiance import irradiance
from dermis.frame.features.irradiance.irradiance import TEXEL_AREA
from dermis.frame.features.surface import texels
from dermis.frame.features.translucency import passes as translucency
from dermis.frame.features.translucency.resources import Translucency
from dermis.frame.inputs import Inputs
from dermis.frame.programs import FLOATS, usual_texel
from dermis.frame.technique import ProfileSplit, TechniqueResources, TechniqueTraits, channel_weights
from dermis.gpu import (
    ComputeProgram,
    Device,
    Graph,
    Memo,
    Record,
    Recorder,
    Texture,
    TextureOrView,
)
from dermis.gpu.textures import FORMAT_BYTES
from dermis.optics.gaussians import GaussianSum
from dermis.scene.settings import Settings

# A Gaussian narrower than this is finer than texels and pores: it is relit in the image, not blurred.
_RELIT_MM2 = 0.1**2


class Technique(TechniqueTraits):
    """How light spreads below the skin; in this base class it leaves where it entered.

    Its name is that of its line in `scene.techniques.TECHNIQUES`.
    """

    def make_levels(self, device: Device, side: int, halvings: Halvings) -> Levels:
        """Return textures for light and its blurred levels; the least size where no light is on the atlas."""
        return make_levels(device, side, halvings, FLOATS)

    def make_sum(self, device: Device, side: int) -> Texture:
        """Return space for the light that leaves below the surface."""
        return combine.make_sum(device, side)

    def chain(
        self, split: ProfileSplit, atlas: AtlasTextures, edge: str
    ) -> tuple[ProfileSplit, tuple[int, ...]]:
        """Return the split with weightless levels that lead to others, and which those are; here none."""
        return split, ()

    def halvings(self, split: ProfileSplit, atlas: AtlasTextures, edge: str) -> tuple[int, ...]:
        """Return how often the resolution of each level is halved, that of the unblurred one first."""
        return (0,) * (1 + len(split.blurred_mm2))

    def make(
        self, memo: Memo, device: Device, settings: Settings, profile: GaussianSum
    ) -> TechniqueResources | None:
        """Return the technique's own tables and textures, kept by the memo."""
        return None

    def make_apart(self, memo: Memo, device: Device, settings: Settings) -> TechniqueResources | None:
        """Return space for light that the shading of outputs keeps apart; None for none."""
        return None

    def describe(self, view: Record, shade: ComputeProgram, own: TechniqueResources | None) -> None:
        """Write what the shading pass needs to its record.

        shade : the pass' program
        """

    def apart(self, own: TechniqueResources | None) -> Texture | None:
        """Return the texture for light that the shading keeps apart, None when it keeps none."""
        return None

    def scatter(self, graph: Graph, inputs: Inputs) -> Texture:
        """Declare the passes before the shading; return the texture that it reads as `scattered`."""
        return inputs.resources.scattered

    def finish(self, graph: Graph, inputs: Inputs, radiance: Texture) -> Texture:
        """Declare the passes after the shading; return the texture that holds the picture."""
        return radiance

    def spread(self, graph: Graph, inputs: Inputs) -> tuple[TextureOrView, TextureOrView]:
        """Spread the light of `make_apart`; return textures of it and of the share of it that leaves."""
        raise NotImplementedError

    def leave_through(self, graph: Graph, inputs: Inputs, into: tuple[Texture, ...]) -> Texture:
        """Add up only the light through thin parts; return the texture of all layouts.

        into : textures of the atlas, of each layout and, of several, all together
        """
        raise NotImplementedError


class AtlasTechnique(Technique):
    """Light that spreads over the atlas: lit there, blurred by each of the profile's Gaussians, added up."""

    on_atlas = True

    def gaussians(self, profile: GaussianSum) -> GaussianSum:
        """The sum of Gaussians to blur by."""
        return profile

    def relights(self, profile: GaussianSum) -> bool:
        """Whether the narrowest Gaussian is lit again in the picture instead of blurred."""
        return bool(profile.variance_mm2[0] <= _RELIT_MM2)

    def split(self, profile: GaussianSum, white: bool) -> ProfileSplit:
        """What is lit again, and the Gaussians that blur."""
        profile = self.gaussians(profile)
        weight = channel_weights(profile, white)
        total = weight.sum(axis=0)
        if self.relights(profile):
            return ProfileSplit(weight[0], total, profile.variance_mm2[1:], weight[1:])
        return ProfileSplit(np.zeros(3), total, profile.variance_mm2, weight)

    def make_levels(self, device: Device, side: int, halvings: Halvings) -> Levels:
        """Space for light and its blurred levels."""
        return make_levels(device, side, halvings, usual_texel(device))

    def texel_bytes(self, levels: int) -> float:
        """Most memory for a texel of the atlas on a software adapter, with the space between passes."""
        mips = sum(0.25**halving for halving in range(MOST_HALVINGS + 1))
        return FORMAT_BYTES[FLOATS] * (levels + 2 * mips)  # where none is halved that could be

    def halvings(self, split: ProfileSplit, atlas: AtlasTextures, edge: str) -> tuple[int, ...]:
        """How often the resolution of each level is halved, that of the unblurred one first."""
        most = len(atlas.sheets(edge)) - 1
        return halvings_of(split.blurred_mm2, atlas.usual_per_mm, most)

    def scatter(self, graph: Graph, inputs: Inputs) -> Texture:
        """Light each layout, let the light spread, blend two layouts."""
        made = inputs.resources
        levels, layouts, mixture = made.diffusion.levels, inputs.layouts, made.diffusion.mixture
        if not inputs.blurs:
            return made.scattered
        for number, (layout, blur) in enumerate(zip(layouts, inputs.blurs, strict=True)):
            into = levels.layer(0), levels.size, levels.texel, blur.scale, TEXEL_AREA
            graph.repeat(draw_stretch, layout.head, layout.atlas)
            if layout.walked:
                graph.repeat(gutters.draw, layout.atlas, layout.walked.walks, layout.walked.head)
            texels.draw(graph, layout)
            irradiance.draw(graph, layout, inputs.light_constants, *into)
            if layout.translucency:
                graph.repeat(translucency.draw_weights, layout.translucency)
                if layout.translucency.slabs:
                    translucency.draw_slants(graph, layout, layout.translucency, inputs.light_constants)
            graph.repeat(self.fill, levels, layout.atlas, blur)
            leaves = mixture.sum(0) if mixture else layout.scattered
            graph.repeat(self.leave, levels, blur, layout.translucency, leaves)
            if mixture:
                mix.share(graph, layout, mixture, number)
                graph.repeat(self.mix, levels, blur, layout.atlas, mixture, number, layout.scattered)
        if len(layouts) > 1:
            draw_blend(graph, layouts[0], layouts[1], made.scattered)
        return made.scattered

    def fill(self, graph: Recorder, levels: Levels, atlas: AtlasTextures, blur: Blur) -> None:
        """Fill layer k with the light of layer 0 spread by the k-th Gaussian."""
        raise NotImplementedError

    def leave(
        self,
        graph: Recorder,
        levels: Levels,
        blur: Blur,
        thin: Translucency | None,
        into: TextureOrView,
    ) -> None:
        """Let the blurred light through thin parts, and add up what leaves."""
        through = translucency.draw(graph, levels, blur, thin) if thin else None
        combine.draw(graph, levels, blur, into, through, thin.lost if thin else None)

    def mix(
        self,
        graph: Recorder,
        levels: Levels,
        blur: Blur,
        atlas: AtlasTextures,
        mixture: Mixture,
        layout: int,
        into: Texture,
    ) -> None:
        """Add to what leaves by the first profile what others make of it: half as receivers, half as givers.

        Light from y leaves at x as much as light from x at y: (w(x) + w(y)) / 2 of each Gaussian.
        """
        for other, (given, weight) in enumerate(zip(mixture.given, blur.changes, strict=True)):
            change = replace(blur, weight=weight)
            combine.draw(graph, levels, change, mixture.sum(1 + 2 * other))
            mix.give(graph, levels, mixture, layout, other)
            self.fill(graph, given, atlas, blur)
            combine.draw(graph, given, change, mixture.sum(2 + 2 * other))
        mix.draw(graph, mixture, layout, into)

    def leave_through(self, graph: Graph, inputs: Inputs, into: tuple[Texture, ...]) -> Texture:
        """Add up only the light through thin parts, by the passes that add up the blurred light."""
        layouts, levels = inputs.layouts, inputs.resources.diffusion.levels
        for layout, blur, texture in zip(layouts, inputs.blurs, into, strict=False):
            alone, thin = replace(blur, weight=np.zeros_like(blur.weight)), layout.translucency
            assert thin is not None
            combine.draw(graph, levels, alone, texture, thin.light, thin.lost)
        if len(layouts) > 1:
            first, second = (replace(one, scattered=into[k]) for k, one in enumerate(layouts))
            draw_blend(graph, first, second, into[-1])
        return into[-1]
