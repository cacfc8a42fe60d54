"""Light below skin whose profile changes from place to place, as a map says."""

from __future__ import annotations

from typing import Any

from dermis.frame.atlas_layout import AtlasLayout
from dermis.frame.levels import Levels
from dermis.frame.passes import TILE, program, stitch
from dermis.frame.profile_mixture import Mixture
from dermis.gpu import Recorder


def share(graph: Recorder, layout: AtlasLayout, mixture: Mixture, number: int) -> None:
    """Fill the shares of other profiles over an atlas, beyond the charts' edges too.

    number : of the layout
    """
    into, texel = mixture.shares[number], mixture.given[0].texel
    bound = {**layout.lit, **layout.atlas.resources, "share_map": mixture.shares_over_uv, "stored": into}
    shader = program(graph.device, "profile_shares.wgsl", store=texel)
    graph.compute("profiles", shader, bound, into.size[:2])
    stitch.draw(graph, "profiles", layout.atlas, into, texel)


def give(graph: Recorder, levels: Levels, mixture: Mixture, number: int, other: int) -> None:
    """Fill the first of another profile's levels with the light that enters where the skin has it."""
    given, device = mixture.given[other], graph.device
    shader = program(device, "profile_given.wgsl", (("OTHER", other),), levels.texel, levels.texel)
    linear = device.sampler(mag_filter="linear", min_filter="linear")
    light = {"source": levels.layer(0), "linear": linear, "stored": given.layer(0)}
    graph.compute("profiles", shader, light | {"shares": mixture.shares[number]}, (levels.size,) * 2, TILE)


def draw(graph: Recorder, mixture: Mixture, number: int, into: Any) -> None:
    """Mix the sums of blurred light, and put the shares beside them."""
    shader = program(graph.device, "profile_mixture.wgsl", (("OTHERS", len(mixture.given)),))
    bound = {"sums": mixture.sums, "shares": mixture.shares[number], "mixed": into}
    graph.compute("profiles", shader, bound, into.size[:2], TILE)
