"""What the stages of outputs read of a frame."""

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
from dermis.gpu import Bindings, ComputeProgram, Constants, MutableBindings, UniformRecord, Texture, TextureOrView


@dataclass(frozen=True, eq=False)
class PreviousScene:
    """The scene that motion is counted from.

    motion : what moved the head's shape, None where the shape is the same as now
    view : record of the shading, with the rays of its camera
    """

    motion: MotionBytes | None
    view: UniformRecord


@dataclass(frozen=True, eq=False)
class SpreadLight:
    """Light that a technique spreads over the picture, as the outputs need it.

    layers : texture that the shading keeps it in, to be spread
    spread : spreads it; returns textures of the light, and of the share of it that leaves towards the eye
    """

    layers: Texture
    spread: Callable[[], tuple[TextureOrView, TextureOrView]]


@dataclass(frozen=True, eq=False)
class StageInputs:
    """What the stages read of a frame.

    lit : resources of the shading, of the layout that is looked at
    view : record of the struct Shade
    centre_mm : the head's, from which places of a scene are counted
    constants : of the lights, the surface and the technique
    scattered : light below the skin by place on the atlas, or the tables of pre-integrated skin
    camera, head, visibility : how the picture's samples see the head, and the triangles that they see
    shape : the head's
    picture : textures of the finished picture
    hair : whether hair is drawn
    previous : the scene before, None where nothing reads it
    thin : thin parts of the layout that is looked at, None without any
    spread : light that spreads over the picture, None for techniques that spread none
    through : adds up the light through thin parts in textures of the atlas; returns the one of all layouts
    """

    lit: Bindings
    view: UniformRecord
    centre_mm: Triple
    constants: Constants
    scattered: Texture
    camera: Views
    head: HeadGeometry
    visibility: ViewLayers
    shape: Shape
    picture: Picture
    hair: bool
    previous: PreviousScene | None
    thin: Translucency | None
    spread: SpreadLight | None
    through: Callable[[tuple[Texture, ...]], Texture]

    def bound(self, shader: ComputeProgram, centres: Texture) -> MutableBindings:
        """Return the shading's resources with the record Look of surface_hit.wgsl.

        centres : texture of the triangles at the pixels' centres
        """
        look = shader.record("Look", rays=ray_record(shader, self.view), centre=self.centre_mm)
        return {**self.lit, "look": look, "centres": centres}
