"""Traits of a scattering technique, which a request needs before any resources exist."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from dermis.gpu import Constants
from dermis.optics.gaussians import GaussianSum
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ProfileSplit:
    """A profile divided into the level that is lit again in the image and those that are blurred.

    relit, total : (3,) weight of the level that is not blurred, and of all
    blurred_mm2, weight : (k,) and (k, 3) of the blurred levels
    others : the same of profiles that a map mixes into this one, of the same Gaussians
    fine : members of the shader's struct Fine, none where the picture shows what texels hold
    """

    relit: Floats
    total: Floats
    blurred_mm2: Floats
    weight: Floats
    others: tuple[ProfileSplit, ...] = ()
    fine: dict[str, float | NDArray[np.floating]] = field(default_factory=dict)

    @property
    def relit_changes(self) -> Floats:
        """(o, 3) by which the others' weights of the level that is not blurred differ."""
        return np.array([one.relit - self.relit for one in self.others]).reshape(-1, 3)

    @property
    def changes(self) -> tuple[Floats, ...]:
        """(k, 3) by which each other's weights of the blurred levels differ."""
        return tuple(one.weight - self.weight for one in self.others)


class TechniqueResources:
    """Base class of what a technique makes for itself: tables, and space beside the atlas."""


class TechniqueTraits:
    """What a technique states of itself; `techniques.technique.Technique` adds resources and passes.

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

    def split(self, profile: GaussianSum, white: bool) -> ProfileSplit:
        """Return the profile as the technique uses it; here no light is blurred.

        white : renormalise each channel's weights to 1, so that the colour map alone gives the colour
        """
        total = channel_weights(profile, white).sum(axis=0)
        return ProfileSplit(total, total, np.empty(0), np.empty((0, 3)))

    def stretch(self, settings: Settings) -> str:
        """Return how blurs follow the map's stretch, one of `Settings.stretch`."""
        return settings.stretch

    def texel_bytes(self, levels: int) -> float:
        """Return bytes for each texel of the atlas on a software adapter, with the space between passes."""
        return 0.0


def channel_weights(profile: GaussianSum, white: bool) -> Floats:
    """Return the (k, 3) weights of a profile's Gaussians, divided by its albedo for `white` skin."""
    return profile.weight / profile.albedo if white else profile.weight
