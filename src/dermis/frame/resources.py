"""The resources of a frame: a collection of what its features made, and its atlas layouts."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features import diffusion, hair, outputs, post, shape
from dermis.frame.features.atlas.lit import LitAtlas
from dermis.frame.features.interreflection.interreflection import Interreflection
from dermis.frame.features.occlusion.moving import MovingOcclusion, Sky
from dermis.frame.features.shadows.shadows import ShadowMaps
from dermis.frame.features.shape.mesh import HeadResources
from dermis.frame.features.surface.painting.paint import Face
from dermis.frame.features.translucency.resources import Translucency
from dermis.frame.features.visibility.layers import Layers
from dermis.frame.technique import TechniqueResources
from dermis.gpu import Constants, Record, Texture


@dataclass(frozen=True, eq=False)
class AtlasLayout(LitAtlas):
    """An atlas of the head that light is spread on.

    translucency : light through thin parts, None without any
    occlusion : what updates the map of occlusion as the shape moves, None where it does not move
    interreflection : light from skin to skin, None for none
    """

    translucency: Translucency | None = None
    occlusion: MovingOcclusion | None = None
    interreflection: Interreflection | None = None


@dataclass(frozen=True, eq=False)
class Resources:
    """The resources of all features.

    face : the painted maps as far as expressions change them, None where nothing does
    layouts : atlases that light is spread on; the first is the one that is looked at
    scattered : texture of the light that leaves below the surface
    technique : what the technique made for itself, None for nothing
    spread : what it made to spread outputs over the picture, None for nothing
    sky : the open sky at the head's vertices, None where occlusion does not follow its shape
    hair : None for none
    view, constants : record of the shading pass without the camera, and its pipeline constants
    outputs : space for what is requested besides the picture, None for nothing
    suns : number of lights that the environment adds
    gaussians : number of terms of the profile
    unscattered : share of the skin's triangles that the atlas cannot hold
    """

    shape: shape.Resources
    face: Face | None
    layouts: tuple[AtlasLayout, ...]
    shadow_maps: ShadowMaps
    diffusion: diffusion.Resources
    scattered: Texture
    technique: TechniqueResources | None
    spread: TechniqueResources | None
    sky: Sky | None
    hair: hair.Resources | None
    visibility: Layers
    view: Record
    constants: Constants
    post: post.Resources
    outputs: outputs.Resources | None
    suns: int
    gaussians: int
    unscattered: float

    @property
    def head(self) -> HeadResources:
        """The head's triangles, as the layout that is looked at has them."""
        return self.layouts[0].head
