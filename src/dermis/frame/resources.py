"""Resources of a frame: the resources of all features, and the atlas layouts."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features import diffusion, hair, outputs, post, shape
from dermis.frame.features.atlas.lit_atlas import LitAtlas
from dermis.frame.features.interreflection.interreflection import Interreflection
from dermis.frame.features.occlusion.moving import MovingOcclusion, VertexSkyVisibility
from dermis.frame.features.shadows.shadows import ShadowMaps
from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.frame.features.surface.painting.paint import ExpressionMaps
from dermis.frame.features.translucency.resources import Translucency
from dermis.frame.features.visibility.layers import ViewLayers
from dermis.frame.technique import TechniqueResources
from dermis.gpu import Constants, Texture, UniformRecord


@dataclass(frozen=True, eq=False)
class AtlasLayout(LitAtlas):
    """Atlas layout in which light is diffused, with its resources.

    translucency : resources of the light through thin parts of the head, None if the scene has no such light
    occlusion : resources that update the occlusion map when the shape changes, None if it is not updated
    interreflection : resources of interreflection, None if there is no interreflection
    """

    translucency: Translucency | None = None
    occlusion: MovingOcclusion | None = None
    interreflection: Interreflection | None = None


@dataclass(frozen=True, eq=False)
class Resources:
    """Cached resources of a frame, for all features.

    shape : buffers of the head's shape
    expression_maps : painted maps that expressions change, None if no map changes
    layouts : atlas layouts in which light is diffused; the picture is shaded from the first layout
    shadow_maps : shadow maps of all lights
    diffusion : textures and Gaussians for blurs of the light in the atlas
    scattered : texture with the exitance of scattered light over the atlas
    technique : tables and textures of the technique; None if the technique needs none
    output_layers : textures in which the technique diffuses subsurface light for the outputs besides the
        picture; None if no requested output needs them
    sky : visible fraction of the sky at the vertices, None if it is not recomputed when the shape changes
    hair : resources of the hair, None if no hair is drawn
    visibility : texture with the index of the triangle that covers each sample of the picture
    view : uniform record of the shading pass, without the camera
    constants : pipeline constants of the shading pass
    post : resources of post-processing, among them the picture
    outputs : resources of the outputs besides the picture, None if none are requested
    suns : number of lights that the environment adds
    gaussians : number of Gaussians of the profile
    unscattered_fraction : number of skin triangles that lie outside the atlas, where no light scatters,
        divided by the number of all skin triangles [-]
    """

    shape: shape.Resources
    expression_maps: ExpressionMaps | None
    layouts: tuple[AtlasLayout, ...]
    shadow_maps: ShadowMaps
    diffusion: diffusion.Resources
    scattered: Texture
    technique: TechniqueResources | None
    output_layers: TechniqueResources | None
    sky: VertexSkyVisibility | None
    hair: hair.Resources | None
    visibility: ViewLayers
    view: UniformRecord
    constants: Constants
    post: post.Resources
    outputs: outputs.Resources | None
    suns: int
    gaussians: int
    unscattered_fraction: float

    @property
    def head(self) -> HeadGeometry:
        """Return the triangles of the head with their coordinates in the first atlas layout."""
        return self.layouts[0].head
