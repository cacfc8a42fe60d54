"""Atlas of the head with the resources that light its texels."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features.atlas.gutters import GutterTracing
from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.gpu import MutableBindings, Texture


@dataclass(frozen=True, eq=False)
class GutterUpdate:
    """Inputs of the passes that determine, for each person, from where gutter texels copy light.

    tracing : inputs that are the same for all people
    head : surface of the person at rest
    """

    tracing: GutterTracing
    head: HeadGeometry


@dataclass(frozen=True, eq=False)
class LitAtlas:
    """Atlas of the head with the resources that light its texels.

    atlas : textures of the atlas
    head : triangles with their coordinates in the atlas
    bindings : dictionary from names in the shaders to resources: geometry, maps, lights, shadows, environment
    surfaces : texture of the surface properties at each texel, packed by surface_texels.wgsl
    scattered : texture of the exitance by subsurface scattering at each texel
    gutter_update : inputs of the passes that trace the gutters for each person, None if the gutters are
        constant
    """

    atlas: AtlasTextures
    head: HeadGeometry
    bindings: MutableBindings
    surfaces: Texture
    scattered: Texture
    gutter_update: GutterUpdate | None = None
