"""Atlas of the head with the resources that light its texels."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features.atlas.gutters import GutterTracing
from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.shape.mesh import HeadGeometry
from dermis.gpu import MutableBindings, Texture


@dataclass(frozen=True, eq=False)
class GutterUpdate:
    """Inputs of the passes that find, for each person, the positions from which gutter texels copy light.

    tracing : inputs of these passes that are the same for all people who share the atlas
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
    gutter_update : inputs of the passes that find from where gutter texels copy light; None if these
        positions are the same for all people
    """

    atlas: AtlasTextures
    head: HeadGeometry
    bindings: MutableBindings
    surfaces: Texture
    scattered: Texture
    gutter_update: GutterUpdate | None = None
