"""The blurred levels of light: their textures, formats and resolutions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dermis.frame.programs import FLOATS
from dermis.gpu import Device, Texture, TextureView, make_texture, scratch
from dermis.gpu.textures import view_of

_BRIGHT = 16.0  # scaled irradiance of all lights, a 4000th of the largest half
_MOST_SCALED = 2.0**100  # its inverse is a float too; light that would need more counts as none
Floats = NDArray[np.float64]
Halvings = tuple[tuple[int, ...], ...]
"""Of each layout, how often the resolution of each level is halved, see `Blur`."""
SHARP = 0.45  # least standard deviation [mm] of a halved level, over its squared texel side [mm^2]
LEAST_WEIGHT = 1e-12
"""By which shares of a colour that nothing blurs are taken."""


@dataclass(frozen=True, eq=False)
class Levels:
    """Textures for light and its blurred levels, level 0 unblurred, and for light between two passes.

    stacks : for each number of halvings a texture with a layer for each level of that resolution, before
        them the last finer one, halved
    first : the level in the first layer of each
    texel : format of the textures
    """

    stacks: tuple[Texture, ...]
    first: tuple[int, ...]
    scratch: Texture
    size: int
    texel: str
    _views: dict[tuple[int, int], TextureView] = field(default_factory=dict)

    def layer(self, k: int, halvings: int = 0) -> TextureView:
        """A view of level k at one resolution."""
        if (k, halvings) not in self._views:
            layer = k - self.first[halvings]
            self._views[k, halvings] = view_of(self.stacks[halvings], layer=layer)
        return self._views[k, halvings]

    def spare(self, halvings: int = 0) -> TextureView:
        """A view of the texture between two passes."""
        if (-1, halvings) not in self._views:
            self._views[-1, halvings] = view_of(self.scratch, mip=halvings)
        return self._views[-1, halvings]


@dataclass(frozen=True)
class Blur:
    """How light spreads over an atlas.

    variance_mm2, weight : (k,) increasing, and (k, 3) of the Gaussians
    halvings : how often the resolution of each level is halved, that of the unblurred one first
    scale : factor of the light in the layers
    edge : what lies beyond a chart's edge and its gutter: "repeated", "cleared" or "skipped"
    clear : the light that empty texels show when the edge is "cleared"
    steps : levels without weight that only lead to others, counted from the unblurred one
    changes : (k, 3) by which the weights of each profile that a map mixes in differ
    """

    variance_mm2: Floats
    weight: Floats
    halvings: tuple[int, ...]
    scale: float = 1.0
    edge: str = "repeated"
    clear: tuple[float, float, float] = (0.0, 0.0, 0.0)
    steps: tuple[int, ...] = ()
    changes: tuple[Floats, ...] = ()

    @property
    def own(self) -> tuple[int, ...]:
        """The layers of the unblurred light and of the profile's levels, without those that lead to them."""
        return tuple(k for k in range(len(self.halvings)) if k not in self.steps)


def make_levels(device: Device, size: int, halvings: Halvings, texel: str) -> Levels:
    """Space for the light that enters and the blurred levels, of the format `texel`."""
    held = layers_of(halvings)
    stacks = tuple(
        make_texture(device, (size >> times,) * 2, texel, layers=len(levels), name="blurred light")
        for times, levels in enumerate(held)
    )
    between = mark_scratch(
        device, make_texture(device, (size, size), texel, mips=len(held), name="light between two blurs")
    )
    return Levels(stacks, tuple(levels.start for levels in held), between, size, texel)


def layers_of(halvings: Halvings) -> tuple[range, ...]:
    """The levels that are held at each resolution."""
    coarsest = max(map(max, halvings))
    return tuple(
        range(
            min(one.index(times) for one in halvings if times in one) - (times > 0),
            max(len(one) - one[::-1].index(times) for one in halvings if times in one),
        )
        for times in range(coarsest + 1)
    )


def scale_of(texel: str, brightest: float) -> float:
    """Factor that brings light into the range of halves: a power of two, which is exact; 1 for floats.

    brightest : sum of the lights' irradiances as given; skin nearer to a light gets more
    """
    if texel == FLOATS or brightest == 0.0:
        return 1.0
    return math.ldexp(0.5, math.frexp(min(_BRIGHT / brightest, _MOST_SCALED))[1])


def halvings_of(variance_mm2: NDArray[np.float64], texels_per_mm: float, most: int) -> tuple[int, ...]:
    """How often the resolution of each level may be halved, the unblurred one included.

    Texels twice as large need a blur four times as wide: what they lose in the sparse parts of a map is then
    as small a part of the image (docs/performance.md has the errors).

    variance_mm2 : of the blurred levels, increasing
    texels_per_mm : of the map
    """
    found = [0]
    for before in (0.0, *variance_mm2[:-1]):
        smooth = texels_per_mm * math.sqrt(math.sqrt(before) / SHARP)
        finest, coarsest = found[-1], min(most, found[-1] + 1)
        found.append(int(min(max(math.log2(max(smooth, 1.0)), finest), coarsest)))
    return tuple(found)
