"""A technique of another package: light leaves where it enters, and half of it is lost."""

from __future__ import annotations

from pathlib import Path

from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.diffusion.pyramid import Blur, PyramidLevels
from dermis.frame.programs import TILE_SIDE, program
from dermis.frame.technique import ProfileSplit
from dermis.frame.techniques.technique import AtlasTechnique
from dermis.gpu import Recorder
from dermis.optics.fits.gaussian import single_gaussian
from dermis.optics.gaussians import GaussianSum

LEFT = 0.5


class Dim(AtlasTechnique):
    """Technique with one level of light, which is not blurred."""

    sources = ("Borshukov2003",)

    def gaussians(self, profile: GaussianSum) -> GaussianSum:
        """Return one Gaussian with all of the profile's light."""
        return single_gaussian(profile)

    def leaves_narrowest_unblurred(self, profile: GaussianSum) -> bool:
        """Return False."""
        return False

    def level_halvings(self, split: ProfileSplit, atlas: AtlasTextures, edge_mode: str) -> tuple[int, ...]:
        """Return 0 for both levels."""
        return (0, 0)

    def blur_levels(self, graph: Recorder, levels: PyramidLevels, atlas: AtlasTextures, blur: Blur) -> None:
        """Declare the pass that halves the light."""
        shader = program(graph.device, Path(__file__).parent / "dim.wgsl", store_format=levels.texel_format)
        bound = {"light": levels.layer(0), "stored": levels.layer(1)}
        graph.compute("dim", shader, bound, (levels.size, levels.size), TILE_SIDE)


TECHNIQUE = Dim()
