"""Resources of translucency: pairs of points on both sides of thin parts, and the light between them."""

from __future__ import annotations

from dataclasses import dataclass, field

from dermis.atlas.translucency.cells import Cells
from dermis.gpu import Bindings, Buffer, Texture


@dataclass(frozen=True, eq=False)
class PairBuffers:
    """Translucent pairs of a surface: a source, where light enters, and a receiver, where it leaves.

    cells : cells of the coarse atlas
    receivers, sources : buffers of the cells that have pairs, see translucency_receivers.wgsl and
        translucency_sources.wgsl, each with its number of rows
    pairs : buffer of source, receiver and offset in the atlas, see translucency_weights.wgsl
    count : number of pairs
    receiver_ranges : buffer of cells and the range of their pairs, see translucency.wgsl
    transmitted : texture of the coarse atlas for the transmitted light, and 1 where there is surface
    lost : texture of the coarse atlas for the fraction of light that is not returned, likewise
    """

    cells: Cells
    receivers: tuple[Buffer, int]
    sources: tuple[Buffer, int]
    pairs: Buffer
    count: int
    receiver_ranges: Buffer
    transmitted: Texture
    lost: Texture


@dataclass(frozen=True, eq=False)
class Translucency:
    """Resources of the light through thin parts of one atlas layout.

    pairs : translucent pairs
    surface : resources of geometry.wgsl and of the atlas, for the current shape
    receiver_points, source_points : buffers of the current positions of receivers and sources
    weights : buffer of the fraction of light that passes between each pair
    source_light : buffer of the light at the sources
    unit_light : buffer of light 1 at all sources
    direction_factors : buffer of the factor of each source's light in deep slabs, by its directions
    weight_bindings, loss_bindings : resources of the profile for translucency_weights.wgsl: for the
        transmitted light, and for the light that is not returned because of it
    gaussian_count : number of Gaussians of the profile
    uses_tables : whether transmittance is read from tables by thickness
    source_level : index of the blurred level whose light enters, 0 for the first one
    """

    pairs: PairBuffers
    surface: Bindings
    receiver_points: Buffer
    source_points: Buffer
    weights: Buffer
    source_light: Buffer
    direction_factors: Buffer
    unit_light: Buffer
    weight_bindings: Bindings = field(default_factory=dict)
    loss_bindings: Bindings = field(default_factory=dict)
    gaussian_count: int = 0
    uses_tables: bool = False
    source_level: int = 0
