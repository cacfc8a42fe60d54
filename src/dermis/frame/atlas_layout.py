"""An atlas of the head on the device, over which light spreads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from dermis.frame.atlas_textures import AtlasTextures
from dermis.frame.geometry import HeadResources


@dataclass(frozen=True, eq=False)
class PairBuffers:
    """Translucent pairs on a device, and their geometry.

    side : of the coarse atlas
    receivers : buffer of cells that receive light, as translucency.wgsl reads them
    pairs, sources : buffers of words, as translucency_weights.wgsl reads them
    count, source_count, receiver_count : of pairs, sources and receivers
    light : texture of the coarse atlas for the transmitted light, none yet; alpha is 1 where there is surface
    key : identifies the pairs, so that a profile's weights can be kept on disk; empty to keep none
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
    """Light through the thin parts of an atlas.

    pairs : translucent pairs
    weights : buffer from `weigh`
    layer : blurred level, counted from 0, that the sources read
    gathered : buffer for the light of the sources
    """

    pairs: PairBuffers
    weights: Any
    layer: int
    gathered: Any

    @property
    def light(self) -> Any:
        """Texture of the coarse atlas for the transmitted light."""
        return self.pairs.light


@dataclass(frozen=True, eq=False)
class MovingOcclusion:
    """What an occlusion map is made from that follows the head's shape.

    resting : texture of the open sky as the head rests
    corners : texture of the vertices between which each texel lies, as moving_occlusion_corners.wgsl fills it
    """

    resting: Any
    corners: Any


@dataclass(frozen=True, eq=False)
class AtlasLayout:
    """An atlas of the head with the resources that light its texels.

    head : its triangles, as they lie in the atlas
    lit : resources by the shaders' names: geometry, maps, lights, shadows, surroundings
    surfaces : texture of the surface at each texel, as surface_texels.wgsl packs it
    scattered : texture of the light that leaves below the surface
    translucency : light through thin parts, None without any
    occlusion : what the map of occlusion follows the head's shape by, None where it does not
    """

    atlas: AtlasTextures
    head: HeadResources
    lit: dict[str, Any]
    surfaces: Any
    scattered: Any
    translucency: Translucency | None = None
    occlusion: MovingOcclusion | None = None
