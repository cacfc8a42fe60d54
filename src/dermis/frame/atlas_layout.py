"""An atlas of the head that light is spread on, as textures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dermis.frame.atlas_textures import AtlasTextures
from dermis.frame.geometry import HeadTextures
from dermis.frame.passes.translucency import Thin


@dataclass(frozen=True)
class Layout:
    """An atlas of the head, and what its texels are lit by.

    lit : resources by the shaders' names: geometry, maps, lights, shadows, surroundings
    scattered : texture of the light that leaves below the surface
    thin : translucent pairs and space for their light, None where no light comes through
    """

    head: HeadTextures
    atlas: AtlasTextures
    lit: dict[str, Any]
    scattered: Any
    thin: Thin | None = None
