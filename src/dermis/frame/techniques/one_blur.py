"""Single Gaussian blur of the light map, the state of the art before 2007."""

from __future__ import annotations

from dermis.frame.technique import ProfileSplit
from dermis.frame.techniques.technique import AtlasTechnique
from dermis.frame.techniques.texture_space import TextureSpace
from dermis.optics.fits.gaussian import single_gaussian
from dermis.optics.gaussians import GaussianSum
from dermis.scene.settings import Settings


class OneBlur(TextureSpace):
    """Technique that blurs with a single Gaussian instead of the profile.

    The width of the Gaussian in texels is the same everywhere.
    """

    sources = ("Borshukov2003", "Green2004")
    stitches_seams = False
    supports_translucency = False

    def gaussians(self, profile: GaussianSum) -> GaussianSum:
        """Return the single Gaussian that replaces a profile."""
        return single_gaussian(profile)

    def split_profile(self, profile: GaussianSum, normalise_weights: bool) -> ProfileSplit:
        """Return the split of a profile: a single Gaussian that blurs light.

        Unlike the split of `TextureSpace`, this split has no correction for light that varies within a texel.

        normalise_weights : whether to scale the weights of each channel to a sum of 1, so that only the
            colour map sets the albedo
        """
        return AtlasTechnique.split_profile(self, profile, normalise_weights)

    def leaves_narrowest_unblurred(self, profile: GaussianSum) -> bool:
        """Return False: even if the only Gaussian is very narrow, light is blurred with it."""
        return False

    def stretch_correction(self, settings: Settings) -> str:
        """Return the stretch correction "none": blurs assume the same texel density over the whole map."""
        return "none"


TECHNIQUE = OneBlur()
