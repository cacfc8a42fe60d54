"""Light through thin parts: translucent pairs of places, and what passes between them, on the device."""

from __future__ import annotations

from dataclasses import dataclass, field

from dermis.atlas.translucency.cells import Cells
from dermis.gpu import Bindings, Buffer, Texture


@dataclass(frozen=True, eq=False)
class PairBuffers:
    """Pairs of places of a surface on a device.

    cells : of the coarse atlas
    receivers, sources : buffers of those with pairs, as translucency_receivers.wgsl and
        translucency_sources.wgsl read them, and how many there are
    pairs : buffer of source, receiver and offset in the map, as translucency_weights.wgsl reads them
    count : of pairs
    sums : buffer of cells and their pairs, as translucency.wgsl reads them
    light : texture of the coarse atlas for what comes through, none yet, and 1 where there is surface
    lost : the same for the share that is not returned where light comes through
    """

    cells: Cells
    receivers: tuple[Buffer, int]
    sources: tuple[Buffer, int]
    pairs: Buffer
    count: int
    sums: Buffer
    light: Texture
    lost: Texture


@dataclass(frozen=True, eq=False)
class Translucency:
    """Thin parts of an atlas.

    pairs : translucent pairs
    surface : resources of geometry.wgsl and of the atlas, for where they are now
    receiver_points, source_points : buffers of where the pairs' places are
    weights : buffer of the share of light that each pair lets pass
    gathered : buffer for the light of the sources
    evenly : buffer of the same for sources that all give 1
    slants : buffer of how much of the sources' light passes deep slabs, by its directions
    weighing, losing : what translucency_weights.wgsl reads of a profile, for what it lets pass and for what
        it therefore does not return
    gaussians, slabs : how many these have, and whether they have tables by thickness
    layer : blurred level, counted from 0, whose light passes
    """

    pairs: PairBuffers
    surface: Bindings
    receiver_points: Buffer
    source_points: Buffer
    weights: Buffer
    gathered: Buffer
    evenly: Buffer
    slants: Buffer
    weighing: Bindings = field(default_factory=dict)
    losing: Bindings = field(default_factory=dict)
    gaussians: int = 0
    slabs: bool = False
    layer: int = 0

    @property
    def light(self) -> Texture:
        """Texture of the coarse atlas for what comes through."""
        return self.pairs.light

    @property
    def lost(self) -> Texture:
        """Texture of the coarse atlas for the share that is not returned."""
        return self.pairs.lost
