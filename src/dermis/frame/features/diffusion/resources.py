"""Resources of the diffusion: blurred levels of light, how each atlas blurs, and mixed profiles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.diffusion.pyramid import Blur, Halvings, Levels
from dermis.frame.features.diffusion.mixture import Mixture, make_mixture, upload_shares
from dermis.frame.request import FrameRequest
from dermis.frame.technique import ProfileSplit
from dermis.gpu import Device, Memo


class BlurScheme(Protocol):
    """How a technique blurs over an atlas."""

    def make_levels(self, device: Device, side: int, halvings: Halvings) -> Levels:
        """Return textures for light and its blurred levels."""

    def chain(
        self, split: ProfileSplit, atlas: AtlasTextures, edge: str
    ) -> tuple[ProfileSplit, tuple[int, ...]]:
        """Return the split with weightless levels that lead to others, and which those are."""

    def halvings(self, split: ProfileSplit, atlas: AtlasTextures, edge: str) -> tuple[int, ...]:
        """Return how often the resolution of each level is halved, that of the unblurred one first."""


@dataclass(frozen=True, eq=False)
class Resources:
    """Space for the light that enters the skin, its blurred levels, and their mixtures.

    levels : light and its blurred levels
    blurs : how light spreads on each layout, empty where none does
    mixture : of profiles by a map, None for one profile
    """

    levels: Levels
    blurs: tuple[Blur, ...]
    mixture: Mixture | None


def make(
    memo: Memo,
    device: Device,
    request: FrameRequest,
    scheme: BlurScheme,
    atlases: Sequence[AtlasTextures],
) -> Resources:
    """Return the resources of the diffusion over some layouts."""
    blurs = tuple(_blur(request, scheme, one) for one in atlases) if request.count else ()
    side, halvings = request.settings.atlas if blurs else 1, tuple(blur.halvings for blur in blurs) or ((0,),)
    make = device, scheme, side, halvings, request.light_of
    levels = memo.keep(_make_levels, *make, of=request.view)
    mixture = None
    if request.share_map is not None and blurs:
        ours = (f"{request.view} other {k}" for k in range(len(request.others)))
        given = tuple(memo.keep(_make_levels, *make, of=of) for of in ours)
        mixture = memo.keep(_mixture, device, request.share_map, given, len(atlases), of=request.view)
    return Resources(levels, blurs, mixture)


def _blur(request: FrameRequest, scheme: BlurScheme, atlas: AtlasTextures) -> Blur:
    red, green, blue = (np.pi * c * request.remedy.coloured for c in request.settings.seam_colour)
    edge, clear = request.remedy.edge, (red, green, blue)
    split, steps = scheme.chain(request.split, atlas, edge)
    spread = split.blurred_mm2, split.weight, scheme.halvings(split, atlas, edge)
    return Blur(*spread, edge=edge, clear=clear, steps=steps, changes=split.changes)


def _make_levels(device: Device, scheme: BlurScheme, side: int, halvings: Halvings, _: str) -> Levels:
    return scheme.make_levels(device, side, halvings)


def _mixture(device: Device, shares: NDArray[np.float32], given: tuple[Levels, ...], layouts: int) -> Mixture:
    return make_mixture(device, upload_shares(device, shares), given, layouts)
