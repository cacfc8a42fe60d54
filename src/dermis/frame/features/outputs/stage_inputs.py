"""Inputs of the shaders that compute outputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from dermis.frame.features.post.picture import Picture
from dermis.frame.features.shading.view import ray_record
from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.frame.features.shape.shape import PoseBytes, Shape
from dermis.frame.features.translucency.resources import Translucency
from dermis.frame.features.visibility.layers import ViewLayers
from dermis.frame.projection import Triple, Views
from dermis.gpu import (
    Bindings,
    ComputeProgram,
    Constants,
    MutableBindings,
    Texture,
    TextureOrView,
    UniformRecord,
)


@dataclass(frozen=True, eq=False)
class PreviousScene:
    """Pose and camera of the previous scene, from which motion vectors are computed.

    pose_bytes : pose of the head in the previous scene, None if the pose has not changed since
    view : uniform record of the shading pass with the rays of the previous camera
    """

    pose_bytes: PoseBytes | None
    view: UniformRecord


@dataclass(frozen=True, eq=False)
class PictureDiffusion:
    """Diffusion of subsurface light over the picture, by a screen-space technique.

    layers : texture in which the shading stores the subsurface light
    diffuse : function that declares the passes of the diffusion. It returns textures of the diffused light,
        and of the fraction of this light that leaves the skin towards the camera
    """

    layers: Texture
    diffuse: Callable[[], tuple[TextureOrView, TextureOrView]]


@dataclass(frozen=True, eq=False)
class StageInputs:
    """Inputs of the shaders that compute outputs.

    Some methods of treating seams use atlases with several uv layouts. Inputs that depend on the layout then
    belong to the first layout.

    lighting : dictionary from names in shaders to the resources that light the skin, for the first layout
    view : uniform record of the struct Shade
    centre_mm : centre of the head, the origin of positions of the scene [mm]
    constants : pipeline constants of the lights, the surface and the technique
    scattered : texture of scattered light over the atlas, or tables of pre-integrated skin
    camera : projection of the camera, with the positions of samples in a pixel
    head : triangles of the head
    visibility : texture with the index of the triangle that covers each sample of the picture
    centres : texture with the index of the triangle that covers each pixel centre; equals `visibility` if the
        centre is the only sample
    shape : current shape of the head
    picture : textures of the picture
    has_hair : whether hair is drawn
    previous : pose and camera of the previous scene, None if no motion vectors are requested
    translucency : resources of light through thin parts of the head for the first layout; None if the scene
        has no such light
    picture_diffusion : diffusion over the picture, None unless the technique works in screen space
    sum_transmitted : function that fills the given textures of the atlas with the light through thin parts,
        and returns the texture that combines all layouts
    """

    lighting: Bindings
    view: UniformRecord
    centre_mm: Triple
    constants: Constants
    scattered: Texture
    camera: Views
    head: HeadGeometry
    visibility: ViewLayers
    centres: ViewLayers
    shape: Shape
    picture: Picture
    has_hair: bool
    previous: PreviousScene | None
    translucency: Translucency | None
    picture_diffusion: PictureDiffusion | None
    sum_transmitted: Callable[[tuple[Texture, ...]], Texture]

    def bindings(self, shader: ComputeProgram) -> MutableBindings:
        """Return the resources of `lighting`, with the camera and triangles that surface_hit.wgsl reads.

        shader : shader whose struct OutputCamera determines the format of the camera's uniform record
        """
        camera = shader.make_record("OutputCamera", rays=ray_record(shader, self.view), centre=self.centre_mm)
        return {**self.lighting, "camera": camera, "centres": self.centres.texture}
