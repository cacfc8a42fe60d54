"""Resources of translucency: pairs of cells on opposite faces of thin tissue, and transmitted light."""

from __future__ import annotations

from dataclasses import dataclass, field

from dermis.atlas.translucency.cells import Cells
from dermis.gpu import Bindings, Buffer, Texture


@dataclass(frozen=True, eq=False)
class PairBuffers:
    """Pairs of surface cells on opposite sides of thin tissue, through which light passes.

    Light enters the source cell and leaves the receiver cell. Both are squares of texels of the atlas.

    cells : division of the atlas into cells
    receivers : buffer of the receiver cells, and its number of rows, see translucency_receivers.wgsl
    sources : buffer of the source cells, and its number of rows, see translucency_sources.wgsl
    pairs : buffer of the source, receiver and offset in the atlas of each pair, see translucency_weights.wgsl
    count : number of pairs
    receiver_ranges : buffer of each receiver cell and the range of its pairs, see translucency.wgsl
    transmitted : texture of transmitted light, one texel per cell; alpha is 1 where there is surface
    lost : texture of the fraction of the diffused light that thin tissue does not return, relative to thick
        tissue, one texel per cell; alpha is 1 where there is surface
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
    """Resources of the light through thin parts of the head, for one atlas layout.

    pairs : translucent pairs of source and receiver cells
    surface : resources of geometry.wgsl and of the atlas, for the current shape
    receiver_points : buffer of the current positions and normals of the receivers
    source_points : buffer of the current positions and normals of the sources
    weights : buffer of the fraction of light that passes from source to receiver, for each pair
    source_light : buffer of the light that enters at each source
    unit_light : buffer that holds light of 1 at all sources
    direction_factors : buffer of one factor per source, which describes how the directions of the incident
        light change the transmission; filled by `passes.draw_direction_factors`
    weight_bindings : resources of translucency_weights.wgsl for transmitted light
    loss_bindings : resources of translucency_weights.wgsl for the diffused light that thin tissue does not
        return
    gaussian_count : number of Gaussians that blur light
    uses_tables : whether transmittance is read from tables as a function of thickness
    source_level : index of the Gaussian whose blurred light is used as the light that enters the sources; 0
        is the narrowest
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
