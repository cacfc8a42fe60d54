"""A single blur of the light map, as before 2007."""

from __future__ import annotations

from dermis.frame.technique import ProfileSplit
from dermis.frame.techniques.technique import AtlasTechnique
from dermis.frame.techniques.texture_space import TextureSpace
from dermis.optics.fits.gaussian import single_gaussian
from dermis.optics.gaussians import GaussianSum
from dermis.scene.settings import Settings


class OneBlur(TextureSpace):
    """One Gaussian for all of the profile, alike everywhere on the map."""

    sources = ("Borshukov2003", "Green2004")
    stitches = False
    transmits = False

    def gaussians(self, profile: GaussianSum) -> GaussianSum:
        """The one Gaussian."""
        return single_gaussian(profile)

    def split(self, profile: GaussianSum, white: bool) -> ProfileSplit:
        """The blur alone: texels are shown as they are."""
        return AtlasTechnique.split(self, profile, white)

    def relights(self, profile: GaussianSum) -> bool:
        """No: it blurs all light."""
        return False

    def stretch(self, settings: Settings) -> str:
        """One density for the whole map."""
        return "none"


TECHNIQUE = OneBlur()
