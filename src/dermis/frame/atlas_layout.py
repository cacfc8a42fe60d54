"""An atlas of the head that light is spread on, as textures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dermis.frame.atlas_textures import AtlasTextures
from dermis.frame.geometry import HeadResources


@dataclass(frozen=True, eq=False)
class PairBuffers:
    """Pairs of places on a device, and how they lie.

    side : of the coarse atlas
    receivers : buffer of cells that take light, as translucency.wgsl reads them
    pairs, sources : buffers of words, as translucency_weights.wgsl reads them
    count, source_count, receiver_count : of pairs, sources and receivers
    light : texture of the coarse atlas for what comes through, none yet, and 1 where there is surface
    key : what stands for all of it, so that what a profile makes of it can be kept on disk; empty for no key
    """

    side: int
    radius_mm: float
    spacing_mm: float
    receivers: Any
    pairs: Any
    sources: Any
    count: int
    source_count: int
    receiver_count: int
    light: Any
    key: str = ""


@dataclass(frozen=True, eq=False)
class Translucency:
    """Thin parts of an atlas.

    pairs : translucent pairs
    weights : what `weigh` made of them
    layer : blurred level, counted from 0, whose light passes
    gathered : buffer for the light of the sources
    """

    pairs: PairBuffers
    weights: Any
    layer: int
    gathered: Any

    @property
    def light(self) -> Any:
        """Texture of the coarse atlas for what comes through."""
        return self.pairs.light


@dataclass(frozen=True, eq=False)
class AtlasLayout:
    """An atlas of the head, and what its texels are lit by.

    head : its triangles, as they lie in the atlas
    lit : resources by the shaders' names: geometry, maps, lights, shadows, surroundings
    surfaces : texture of the surface at each texel, as surface_texels.wgsl packs it
    scattered : texture of the light that leaves below the surface
    translucency : what comes through thin parts, None where no light comes through
    """

    atlas: AtlasTextures
    head: HeadResources
    lit: dict[str, Any]
    surfaces: Any
    scattered: Any
    translucency: Translucency | None = None
