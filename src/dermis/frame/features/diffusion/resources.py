"""Resources of the passes that diffuse light over the atlas.

They are the textures of the blur pyramid, the parameters of the Gaussian blurs of each atlas layout, and
textures to blend several diffusion profiles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.diffusion.mixture import ProfileMixture, make_profile_mixture, upload_blend_weights
from dermis.frame.features.diffusion.pyramid import Blur, Halvings, PyramidLevels
from dermis.frame.request import FrameRequest
from dermis.frame.technique import ProfileSplit
from dermis.gpu import Device, Memo


class BlurScheme(Protocol):
    """Interface through which a rendering technique chooses the format and the resolutions of its blurs."""

    def make_levels(self, device: Device, atlas_side: int, halvings: Halvings) -> PyramidLevels:
        """Allocate the blur pyramid for a square atlas.

        atlas_side : side of the atlas at full resolution [texels]
        halvings : for each atlas layout, the number of times that the resolution of each level is halved
        """

    def add_intermediate_levels(
        self, split: ProfileSplit, atlas: AtlasTextures, edge_mode: str
    ) -> tuple[ProfileSplit, tuple[int, ...]]:
        """Insert blurred levels of weight 0 that make the chain of blurs cheaper.

        Each level is computed by blurring the previous level. After an inserted level, light is smooth enough
        for the next level to be computed at a lower resolution. Return a copy of `split` with the inserted
        levels, and their indices.

        split : division of a profile into Gaussians that blur light over the atlas, and a narrower Gaussian
            that is evaluated at each pixel
        edge_mode : how blurs treat texels beyond a chart, see `Blur.edge`
        """

    def level_halvings(self, split: ProfileSplit, atlas: AtlasTextures, edge_mode: str) -> tuple[int, ...]:
        """Return how many times the resolution of each level is halved; level 0 is the unblurred light.

        split : division of a profile into Gaussians that blur light over the atlas, and a narrower Gaussian
            that is evaluated at each pixel
        edge_mode : how blurs treat texels beyond a chart, see `Blur.edge`
        """


@dataclass(frozen=True, eq=False)
class Resources:
    """Resources of the passes that diffuse light over the atlas.

    levels : textures of the blur pyramid, shared by the atlas layouts, whose light is blurred one after
        another
    blurs : parameters of the Gaussian blurs of each atlas layout, empty when no light is blurred
    mixture : textures of profiles that are blended by a map, None for a single profile
    """

    levels: PyramidLevels
    blurs: tuple[Blur, ...]
    mixture: ProfileMixture | None


def make_resources(
    memo: Memo,
    device: Device,
    request: FrameRequest,
    blur_scheme: BlurScheme,
    atlases: Sequence[AtlasTextures],
) -> Resources:
    """Return the pyramid, the blurs and the mixture of profiles for all atlas layouts.

    blur_scheme : technique that chooses the formats and resolutions of the blurs
    atlases : textures of the atlas in each layout
    """
    blurs = tuple(_make_blur(request, blur_scheme, one) for one in atlases) if request.blur_count else ()
    side, halvings = request.settings.atlas if blurs else 1, tuple(blur.halvings for blur in blurs) or ((0,),)
    args = device, blur_scheme, side, halvings, request.light_cache_key
    levels = memo.get(_make_levels, *args, caller_name=request.view_name)
    mixture = None
    if request.blend_weights is not None and blurs:
        names = (f"{request.view_name} other {k}" for k in range(len(request.other_profiles)))
        entering = tuple(memo.get(_make_levels, *args, caller_name=name) for name in names)
        mixture = memo.get(
            _cached_mixture,
            device,
            request.blend_weights,
            entering,
            len(atlases),
            caller_name=request.view_name,
        )
    return Resources(levels, blurs, mixture)


def _make_blur(request: FrameRequest, blur_scheme: BlurScheme, atlas: AtlasTextures) -> Blur:
    red, green, blue = (np.pi * c * request.seam_method.coloured for c in request.settings.seam_colour)
    edge, clear = request.seam_method.edge, (red, green, blue)
    split, intermediate = blur_scheme.add_intermediate_levels(request.profile_split, atlas, edge)
    halvings = blur_scheme.level_halvings(split, atlas, edge)
    return Blur(
        split.blurred_mm2,
        split.weight,
        halvings,
        edge=edge,
        clear=clear,
        intermediate_levels=intermediate,
        weight_differences=split.weight_differences,
    )


def _make_levels(
    device: Device, blur_scheme: BlurScheme, atlas_side: int, halvings: Halvings, _: str
) -> PyramidLevels:
    return blur_scheme.make_levels(device, atlas_side, halvings)


def _cached_mixture(
    device: Device,
    blend_weights: NDArray[np.float32],
    entering_light_pyramids: tuple[PyramidLevels, ...],
    layout_count: int,
) -> ProfileMixture:
    return make_profile_mixture(
        device, upload_blend_weights(device, blend_weights), entering_light_pyramids, layout_count
    )
