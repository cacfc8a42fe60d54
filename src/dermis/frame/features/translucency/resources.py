"""Resources of translucency: pairs of cells on both faces of thin parts, and the light between them."""

from __future__ import annotations

from dataclasses import dataclass, field

from dermis.atlas.translucency.cells import Cells
from dermis.gpu import Bindings, Buffer, Texture


@dataclass(frozen=True, eq=False)
class PairBuffers:
    """Translucent pairs of a surface: source cells, where light enters, and receiver cells, where it leaves.

    cells : cells of the coarse atlas
    receivers, sources : buffers of the cells that are in pairs, each with its number of rows, see
        translucency_receivers.wgsl and translucency_sources.wgsl
    pairs : buffer of source, receiver and offset in the atlas, see translucency_weights.wgsl
    count : number of pairs
    receiver_ranges : buffer of receiver cells and the range of their pairs, see translucency.wgsl
    transmitted : texture of the coarse atlas: transmitted light, and alpha 1 where there is surface
    lost : texture of the coarse atlas: fraction of blurred light that thin tissue does not return, and alpha
        1 where there is surface
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
    """Resources of the light through thin parts, for one atlas layout.

    pairs : translucent pairs
    surface : resources of geometry.wgsl and of the atlas, for the current shape
    receiver_points, source_points : buffers of the current positions and normals of receivers and sources
    weights : buffer of the fraction of light that passes between the cells of each pair
    source_light : buffer of the light that enters at each source
    unit_light : buffer of light 1 at all sources
    direction_factors : buffer of factors by which the directions of each source's light change its
        transmission through deep slabs
    weight_bindings : resources of the profile for translucency_weights.wgsl, for transmitted light
    loss_bindings : resources of the profile for translucency_weights.wgsl, for light that is not returned
    gaussian_count : number of Gaussians that blur light
    uses_tables : whether transmittance is read from tables by thickness
    source_level : index of the blurred level whose light enters at sources, 0 for the narrowest
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
