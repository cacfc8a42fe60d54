"""Inputs of the stages that compute outputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from dermis.frame.features.post.picture import Picture
from dermis.frame.features.shading.view import ray_record
from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.frame.features.shape.shape import MotionBytes, Shape
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
    """Previous scene, from which motion vectors are measured.

    motion : motion of the head, None if its shape has not changed
    view : record of the shading with the rays of the previous camera
    """

    motion: MotionBytes | None
    view: UniformRecord


@dataclass(frozen=True, eq=False)
class PictureDiffusion:
    """Diffusion of the light below the skin over the picture, by a technique in screen space.

    layers : texture in which the shading stores the light
    diffuse : diffuses it, and returns textures of the light and of the fraction of it that leaves
    """

    layers: Texture
    diffuse: Callable[[], tuple[TextureOrView, TextureOrView]]


@dataclass(frozen=True, eq=False)
class StageInputs:
    """Inputs of the stages that compute outputs.

    lighting : resources of the lighting for the first layout
    view : record of the struct Shade
    centre_mm : centre of the head, the origin of positions of the scene [mm]
    constants : pipeline constants of the lights, the surface and the technique
    scattered : texture of the light below the skin over the atlas, or tables of pre-integrated skin
    camera, head, visibility : views of the samples of a pixel, the triangles, and the triangle at each sample
    centres : triangle at the centre of each pixel; `visibility` if the only sample is there
    shape : current shape of the head
    picture : textures of the finished picture
    has_hair : whether hair is drawn
    previous : previous scene, None if it is not needed
    translucency : light through thin parts of the first layout, None without any
    picture_diffusion : diffusion over the picture, None for techniques without it
    sum_transmitted : sums the light through thin parts in textures of the atlas, and returns the one that
        combines all layouts
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
        """Return the resources of the lighting with those of surface_hit.wgsl."""
        camera = shader.record("OutputCamera", rays=ray_record(shader, self.view), centre=self.centre_mm)
        return {**self.lighting, "camera": camera, "centres": self.centres.texture}
