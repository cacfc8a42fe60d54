"""An atlas of the head with the resources that light its texels."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.frame.features.atlas.gutters import Walks
from dermis.frame.features.atlas.textures import AtlasTextures
from dermis.frame.features.shape.mesh import HeadResources
from dermis.gpu import MutableBindings, Texture


@dataclass(frozen=True, eq=False)
class Walked:
    """Inputs of the gutters that are recomputed for each person.

    walks : what they begin with
    head : the person's surface at rest
    """

    walks: Walks
    head: HeadResources


@dataclass(frozen=True, eq=False)
class LitAtlas:
    """An atlas of the head with the resources that light its texels.

    head : its triangles, as they lie in the atlas
    lit : resources by the shaders' names: geometry, maps, lights, shadows, surroundings
    surfaces : texture of the surface at each texel, as surface_texels.wgsl packs it
    scattered : texture of the light that leaves below the surface
    walked : what its gutters follow the person by, None where they are the head's own or there are none
    """

    atlas: AtlasTextures
    head: HeadResources
    lit: MutableBindings
    surfaces: Texture
    scattered: Texture
    walked: Walked | None = None
