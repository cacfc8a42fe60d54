"""The interface of scattering techniques, and the base of those that diffuse light over the atlas."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from dermis.frame.atlas_textures import AtlasTextures
from dermis.frame.fine_light import TEXEL_AREA
from dermis.frame.inputs import Inputs
from dermis.frame.levels import (
    FLOATS,
    MOST_HALVINGS,
    Blur,
    Halvings,
    Levels,
    Split,
    halvings_of,
    make_levels,
    usual_texel,
)
from dermis.frame.passes import (
    blend,
    combine,
    gutters,
    irradiance,
    profile_mixture,
    stretch,
    surface_texels,
    translucency,
    translucency_weights,
)
from dermis.frame.profile_mixture import Mixture
from dermis.gpu import Constants, Device, Graph, Memo
from dermis.gpu.textures import FORMAT_BYTES
from dermis.optics.gaussians import GaussianSum
from dermis.scene.settings import Settings

# A Gaussian narrower than this is finer than texels and pores: it is relit in the image, not blurred.
_RELIT_MM2 = 0.1**2


class Technique:
    """How light spreads below the skin; in this base class it leaves where it entered.

    Its name is that of its line in `scene.techniques.TECHNIQUES`.

    sources : keys of the bibliography
    on_atlas : whether light spreads over the atlas
    mixes : whether it can mix profiles by a map
    stitches : whether it can carry light across the map's seams
    transmits : whether light comes through thin parts
    curved : whether the shading reads the surface's curvature
    shade_constants : pipeline constants of the shading pass
    pixel_bytes : of memory for each pixel, besides the picture
    apart_bytes : of memory for each pixel for `make_apart`
    """

    sources: ClassVar[tuple[str, ...]] = ()
    on_atlas: ClassVar[bool] = False
    mixes: ClassVar[bool] = False
    stitches: ClassVar[bool] = True
    transmits: ClassVar[bool] = False
    curved: ClassVar[bool] = False
    shade_constants: ClassVar[Constants] = ()
    pixel_bytes: ClassVar[int] = 0
    apart_bytes: ClassVar[int] = 0

    def split(self, profile: GaussianSum, white: bool) -> Split:
        """The profile as the technique uses it.

        white : renormalise each channel's weights to 1, so that the colour map alone gives the colour
        """
        total = _weights(profile, white).sum(axis=0)
        return Split(total, total, np.empty(0), np.empty((0, 3)))

    def stretch(self, settings: Settings) -> str:
        """How blurs follow the map's stretch, one of `Settings.stretch`."""
        return settings.stretch

    def make_levels(self, device: Device, side: int, halvings: Halvings) -> Levels:
        """Textures for light and its blurred levels; of the least size where no light is on the atlas."""
        return make_levels(device, side, halvings, FLOATS)

    def make_sum(self, device: Device, side: int) -> Any:
        """Space for the light that leaves below the surface."""
        return combine.make_sum(device, side)

    def texel_bytes(self, levels: int) -> float:
        """Memory for each texel of the atlas on a software adapter, with the space between passes."""
        return 0.0

    def make(self, memo: Memo, device: Device, settings: Settings, profile: GaussianSum) -> Any:
        """The technique's own tables and textures, kept by the memo."""
        return None

    def describe(self, view: Any, shade: Any, own: Any) -> None:
        """Write what the shading pass needs to its record.

        shade : the pass' program
        """

    def scatter(self, graph: Graph, inputs: Inputs) -> Any:
        """Declare the passes before the shading; returns the texture that it reads as `scattered`."""
        return inputs.resources.scattered

    def apart(self, own: Any) -> Any:
        """Texture for light that the shading keeps apart, None when it keeps none."""
        return None

    def finish(self, graph: Graph, inputs: Inputs, radiance: Any) -> Any:
        """Declare the passes after the shading; returns the texture that holds the picture."""
        return radiance

    def make_apart(self, memo: Memo, device: Device, settings: Settings) -> Any:
        """Space for what the shading of outputs keeps apart, in its texture `layers`; None for nothing."""
        return None

    def spread(self, graph: Graph, inputs: Inputs, apart: Any) -> tuple[Any, Any]:
        """Spread that over the picture; returns textures of the light and of the share of it that leaves."""
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

    def split(self, profile: GaussianSum, white: bool) -> Split:
        """What is lit again, and the Gaussians that blur."""
        profile = self.gaussians(profile)
        weight = _weights(profile, white)
        total = weight.sum(axis=0)
        if self.relights(profile):
            return Split(weight[0], total, profile.variance_mm2[1:], weight[1:])
        return Split(np.zeros(3), total, profile.variance_mm2, weight)

    def make_levels(self, device: Device, side: int, halvings: Halvings) -> Levels:
        """Space for light and its blurred levels."""
        return make_levels(device, side, halvings, usual_texel(device))

    def texel_bytes(self, levels: int) -> float:
        """Most memory for a texel of the atlas on a software adapter, with the space between passes."""
        mips = sum(0.25**halving for halving in range(MOST_HALVINGS + 1))
        return FORMAT_BYTES[FLOATS] * (levels + 2 * mips)  # where none is halved that could be

    def chain(self, split: Split, atlas: AtlasTextures, edge: str) -> tuple[Split, tuple[int, ...]]:
        """The split with weightless levels that lead to others, and which those are; here there are none."""
        return split, ()

    def halvings(self, split: Split, atlas: AtlasTextures, edge: str) -> tuple[int, ...]:
        """How often the resolution of each level is halved, that of the unblurred one first."""
        most = len(atlas.sheets(edge)) - 1
        return halvings_of(split.blurred_mm2, atlas.usual_per_mm, most)

    def scatter(self, graph: Graph, inputs: Inputs) -> Any:
        """Light each layout, let the light spread, blend two layouts."""
        resources = inputs.resources
        if not resources.scatters:
            return resources.scattered
        levels, layouts, mixture = resources.levels, inputs.layouts, resources.mixture
        for number, (layout, blur) in enumerate(zip(layouts, inputs.blurs, strict=True)):
            into = levels.layer(0), levels.size, levels.texel, blur.scale, TEXEL_AREA
            graph.repeat(stretch.draw, layout.head, layout.atlas)
            if layout.walked:
                graph.repeat(gutters.draw, layout.atlas, layout.walked.walks, layout.walked.head)
            surface_texels.draw(graph, layout)
            irradiance.draw(graph, layout, inputs.light_constants, *into)
            if layout.translucency:
                graph.repeat(translucency_weights.draw, layout.translucency)
                if layout.translucency.slabs:
                    translucency.draw_slants(graph, layout, inputs.light_constants)
            graph.repeat(self.fill, levels, layout.atlas, blur)
            leaves = mixture.sum(0) if mixture else layout.scattered
            graph.repeat(self.leave, levels, blur, layout.translucency, leaves)
            if mixture:
                profile_mixture.share(graph, layout, mixture, number)
                graph.repeat(self.mix, levels, blur, layout.atlas, mixture, number, layout.scattered)
        if len(layouts) > 1:
            blend.draw(graph, layouts[0], layouts[1], resources.scattered)
        return resources.scattered

    def fill(self, graph: Any, levels: Levels, atlas: AtlasTextures, blur: Blur) -> None:
        """Fill layer k with the light of layer 0 spread by the k-th Gaussian."""
        raise NotImplementedError

    def leave(self, graph: Any, levels: Levels, blur: Blur, thin: Any, into: Any) -> None:
        """Let the blurred light through thin parts, and add up what leaves."""
        through = translucency.draw(graph, levels, blur, thin) if thin else None
        combine.draw(graph, levels, blur, into, through, thin.lost if thin else None)

    def mix(
        self,
        graph: Any,
        levels: Levels,
        blur: Blur,
        atlas: AtlasTextures,
        mixture: Mixture,
        layout: int,
        into: Any,
    ) -> None:
        """Add to what leaves by the first profile what others make of it: half as receivers, half as givers.

        Light from y leaves at x as much as light from x at y: (w(x) + w(y)) / 2 of each Gaussian.
        """
        for other, (given, weight) in enumerate(zip(mixture.given, blur.changes, strict=True)):
            change = replace(blur, weight=weight)
            combine.draw(graph, levels, change, mixture.sum(1 + 2 * other))
            profile_mixture.give(graph, levels, mixture, layout, other)
            self.fill(graph, given, atlas, blur)
            combine.draw(graph, given, change, mixture.sum(2 + 2 * other))
        profile_mixture.draw(graph, mixture, layout, into)

    def leave_through(self, graph: Any, levels: Levels, blur: Blur, thin: Any, into: Any) -> None:
        """Add up only what `leave` let through thin parts, by the same steps."""
        alone = replace(blur, weight=np.zeros_like(blur.weight))
        combine.draw(graph, levels, alone, into, thin.light, thin.lost)


def _weights(profile: GaussianSum, white: bool) -> NDArray[np.float64]:
    return profile.weight / profile.albedo if white else profile.weight
