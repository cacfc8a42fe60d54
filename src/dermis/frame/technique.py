"""Properties of scattering techniques that are known before their resources exist."""

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
    """Split of a profile into a narrow Gaussian, and wider Gaussians that blur light.

    The narrow Gaussian spreads light over so short a distance that no blur is needed: its share of the light
    leaves where it enters. Instead of being read from the atlas, this share is computed again at each pixel
    of the picture. The narrow Gaussian is called the unblurred Gaussian.

    unblurred_weight : (3,) weights of the unblurred Gaussian in red, green and blue; 0 if all Gaussians are
        blurred [-]
    total : (3,) sums of the weights of all Gaussians [-]
    blurred_mm2 : (k,) variances of the Gaussians that blur light [mm^2]
    weight : (k, 3) weights of these Gaussians [-]
    others : splits of the other profiles, if the skin is a blend of several; their variances are the same
    fine : members of the shader struct Fine, for the correction of light that varies within a texel; empty
        for no correction
    """

    unblurred_weight: Floats
    total: Floats
    blurred_mm2: Floats
    weight: Floats
    others: tuple[ProfileSplit, ...] = ()
    fine: dict[str, float | NDArray[np.floating]] = field(default_factory=dict)

    @property
    def unblurred_differences(self) -> Floats:
        """Return the `unblurred_weight` of each split in `others` minus `self.unblurred_weight` [-].

        The result has the shape (n, 3) for n other splits.
        """
        return np.array([one.unblurred_weight - self.unblurred_weight for one in self.others]).reshape(-1, 3)

    @property
    def weight_differences(self) -> tuple[Floats, ...]:
        """Return the (k, 3) `weight` of each split in `others` minus `self.weight` [-]."""
        return tuple(one.weight - self.weight for one in self.others)


class TechniqueResources:
    """Tables and textures of a technique; this base class has no fields."""


class TechniqueTraits:
    """Properties of a technique; its subclass `techniques.technique.Technique` adds resources and passes.

    sources : publications of the technique, as keys of the bibliography
    uses_atlas : whether light is diffused over the atlas
    mixes_profiles : whether a skin can have several diffusion profiles, blended by a map over the skin
    stitches_seams : whether light can cross the seams of the atlas
    supports_translucency : whether light can pass through thin parts of the head
    needs_curvature : whether the shading pass reads the curvature of the surface
    shade_constants : pipeline constants of the shading pass
    pixel_bytes : memory per pixel, without the memory for the picture itself [bytes]
    subsurface_layer_bytes : memory per pixel of the textures of `Technique.make_subsurface_layers` [bytes]
    """

    sources: ClassVar[tuple[str, ...]] = ()
    uses_atlas: ClassVar[bool] = False
    mixes_profiles: ClassVar[bool] = False
    stitches_seams: ClassVar[bool] = True
    supports_translucency: ClassVar[bool] = False
    needs_curvature: ClassVar[bool] = False
    shade_constants: ClassVar[Constants] = ()
    pixel_bytes: ClassVar[int] = 0
    subsurface_layer_bytes: ClassVar[int] = 0

    def split_profile(self, profile: GaussianSum, normalise_weights: bool) -> ProfileSplit:
        """Split a profile into a narrow Gaussian and the Gaussians that blur light.

        The narrow Gaussian is not blurred: its share of the light leaves the skin where it enters, and is
        computed at each pixel. In this class, no light is blurred, and the narrow Gaussian has all the
        weight.

        normalise_weights : whether to scale the weights of each channel to a sum of 1, so that only the
            colour map sets the albedo
        """
        total = channel_weights(profile, normalise_weights).sum(axis=0)
        return ProfileSplit(total, total, np.empty(0), np.empty((0, 3)))

    def stretch_correction(self, settings: Settings) -> str:
        """Return the stretch correction of the blurs: "full", "axes" or "none", see `Settings.stretch`."""
        return settings.stretch

    def texel_bytes(self, blur_count: int) -> float:
        """Return the memory that blurs need per texel of the atlas, including temporary textures [bytes].

        The estimate is for software adapters, which store blurred light in full precision. This base class
        blurs no light and needs no memory.

        blur_count : number of Gaussians that blur light
        """
        return 0.0


def channel_weights(profile: GaussianSum, normalise_weights: bool) -> Floats:
    """Return the (k, 3) weights of a profile's Gaussians for red, green and blue [-].

    normalise_weights : whether to scale the weights of each channel to a sum of 1
    """
    return profile.weight / profile.albedo if normalise_weights else profile.weight
