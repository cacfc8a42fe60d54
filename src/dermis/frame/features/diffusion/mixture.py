"""Profiles mixed by a map: shares over the atlas, and the light of each profile."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.reading import named_path
from dermis.formats.maps import share_map
from dermis.frame.features.atlas.lit import LitAtlas
from dermis.frame.features.atlas.passes import draw_gutters
from dermis.frame.features.diffusion.pyramid import Levels
from dermis.frame.programs import FLOATS, HALVES, TILE, program
from dermis.gpu import Bindings, Device, Recorder, Texture, TextureView, make_texture, upload
from dermis.gpu.textures import view_of
from dermis.images.filters import mip_chain

_KEPT = 4


@dataclass(frozen=True, eq=False)
class Mixture:
    """Space for the light below skin whose profile a map mixes of a first one and one or two others.

    shares_over_uv : texture of the others' shares
    given : for each other, levels of the light that enters where the skin has it
    shares : for each layout, a texture of the others' shares at each texel of the atlas
    sums : texture of the first profile's light, and for each other, how its own differs by what it is where
        light leaves, and by what it is where light enters
    """

    shares_over_uv: Texture
    given: tuple[Levels, ...]
    shares: tuple[Texture, ...]
    sums: Texture
    _views: dict[int, TextureView] = field(default_factory=dict)

    def sum(self, layer: int) -> TextureView:
        """A view of one of the sums."""
        if layer not in self._views:
            self._views[layer] = view_of(self.sums, layer=layer)
        return self._views[layer]


def make_mixture(device: Device, shares: Texture, given: tuple[Levels, ...], layouts: int) -> Mixture:
    """Space for a mixture over atlases of the size of its levels."""
    side, texel = given[0].size, given[0].texel
    over_atlas = tuple(
        make_texture(device, (side, side), texel, name="shares of profiles") for _ in range(layouts)
    )
    layers = sums_of(len(given))
    sums = make_texture(device, (side, side), FLOATS, layers=layers, name="light of mixed profiles")
    return Mixture(shares, given, over_atlas, sums)


def sums_of(others: int) -> int:
    """How many sums of blurred light there are for so many other profiles."""
    return 1 + 2 * others


def upload_shares(device: Device, shares: NDArray[np.float32]) -> Texture:
    """A texture of (h, w, 2) shares with all its mips."""
    height, width = shares.shape[:2]
    levels = mip_chain(np.pad(shares, ((0, 0), (0, 0), (0, 2))))
    texture = make_texture(device, (width, height), HALVES, mips=len(levels), use="map")
    for mip, level in enumerate(levels):
        upload(device, texture, level, mip=mip)
    return texture


def load_shares(name: str) -> NDArray[np.float32]:
    """(h, w, 2) shares of a picture; read again when the file has changed.

    Raises DermisError for what is no such picture.
    """
    path = named_path(name, "a map of profiles")
    try:
        found = path.stat()
    except (OSError, ValueError):
        refuse(
            f"profile map {name}",
            "a picture: grey, or red and green",
            "there is no such file",
            "Check the name",
        )
    return _loaded(path, (found.st_mtime_ns, found.st_size, found.st_ino))


@lru_cache(_KEPT)
def _loaded(path: Path, _: tuple[int, ...]) -> NDArray[np.float32]:
    return share_map(path)


def share(graph: Recorder, layout: LitAtlas, mixture: Mixture, number: int) -> None:
    """Fill the shares of other profiles over an atlas, beyond the charts' edges too.

    number : of the layout
    """
    into, texel = mixture.shares[number], mixture.given[0].texel
    bound: Bindings = {
        **layout.lit,
        **layout.atlas.resources,
        "share_map": mixture.shares_over_uv,
        "stored": into,
    }
    shader = program(graph.device, "diffusion/profile_blend_weights.wgsl", store=texel)
    graph.compute("profiles", shader, bound, into.size[:2])
    draw_gutters(graph, "profiles", layout.atlas, into, texel)


def give(graph: Recorder, levels: Levels, mixture: Mixture, number: int, other: int) -> None:
    """Fill the first of another profile's levels with the light that enters where the skin has it."""
    given, device = mixture.given[other], graph.device
    shader = program(device, "diffusion/profile_entering.wgsl", (("OTHER", other),), levels.texel, levels.texel)
    linear = device.sampler(mag_filter="linear", min_filter="linear")
    light = {"source": levels.layer(0), "stored": given.layer(0)}
    bound: Bindings = {**light, "linear": linear, "shares": mixture.shares[number]}
    graph.compute("profiles", shader, bound, (levels.size,) * 2, TILE)


def draw(graph: Recorder, mixture: Mixture, number: int, into: Texture) -> None:
    """Mix the sums of blurred light, and put the shares beside them."""
    shader = program(graph.device, "diffusion/profile_mixture.wgsl", (("OTHERS", len(mixture.given)),))
    bound: Bindings = {"sums": mixture.sums, "shares": mixture.shares[number], "mixed": into}
    graph.compute("profiles", shader, bound, into.size[:2], TILE)
