"""The blurred levels of light: their textures, formats and resolutions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.gpu import Device, make_texture, scratch

FLOATS = "rgba32float"
"""Format of light in full precision."""
HALVES = "rgba16float"
MOST_HALVINGS = 3
_BRIGHT = 16.0  # scaled irradiance of all lights, a 4000th of the largest half
_MOST_SCALED = 2.0**100  # its inverse is a float too; light that would need more counts as none
SHARP = 0.45  # least standard deviation [mm] of a halved level, over its squared texel side [mm^2]


@dataclass(frozen=True, eq=False)
class Levels:
    """Textures for light and its blurred levels, layer 0 unblurred, and for light between two passes.

    A level that is halved k times is in mip k of its layer.

    texel : format of the textures
    """

    stack: Any
    scratch: Any
    size: int
    texel: str
    _views: dict[tuple[int, int], Any] = field(default_factory=dict)

    def layer(self, k: int, halvings: int = 0) -> Any:
        """A view of one layer."""
        return self._view(self.stack, k, halvings)

    def spare(self, halvings: int = 0) -> Any:
        """A view of the texture between two passes."""
        return self._view(self.scratch, -1, halvings)

    def _view(self, texture: Any, k: int, mip: int) -> Any:
        if (k, mip) not in self._views:
            options = {"dimension": "2d", "array_layer_count": 1, "mip_level_count": 1}
            view = texture.create_view(base_array_layer=max(0, k), base_mip_level=mip, **options)
            self._views[k, mip] = view
        return self._views[k, mip]


@dataclass(frozen=True)
class Blur:
    """How light spreads over an atlas.

    variance_mm2, weight : (k,) increasing, and (k, 3) of the Gaussians
    halvings : how often the resolution of each layer is halved, that of the unblurred one first
    scale : factor of the light in the layers
    edge : what lies beyond a chart's edge and its gutter: "repeated", "cleared" or "skipped"
    clear : the light that empty texels show when the edge is "cleared"
    """

    variance_mm2: NDArray[np.float64]
    weight: NDArray[np.float64]
    halvings: tuple[int, ...]
    scale: float = 1.0
    edge: str = "repeated"
    clear: tuple[float, float, float] = (0.0, 0.0, 0.0)


def usual_texel(device: Device) -> str:
    """Format of levels: halves on GPUs, which read them faster; floats where software converts halves."""
    return FLOATS if device.adapter.kind == "CPU" else HALVES


def make_levels(device: Device, size: int, count: int, texel: str, halved: bool = True) -> Levels:
    """Space for the light that enters and `count` blurred levels of the format `texel`.

    halved : whether there may be levels of less resolution
    """
    mips = 1 + sum(size % 2**times == 0 for times in range(1, MOST_HALVINGS + 1)) if halved else 1
    stack = make_texture(device, (size, size), texel, layers=max(2, count + 1), mips=mips)
    between = scratch(device, make_texture(device, (size, size), texel, mips=mips))
    return Levels(stack, between, size, texel)


def scale_of(texel: str, brightest: float) -> float:
    """Factor that brings light into the range of halves: a power of two, which is exact; 1 for floats.

    brightest : sum of the lights' irradiances as given; skin nearer to a light gets more
    """
    if texel == FLOATS or brightest == 0.0:
        return 1.0
    return math.ldexp(0.5, math.frexp(min(_BRIGHT / brightest, _MOST_SCALED))[1])


def halvings_of(variance_mm2: NDArray[np.float64], texels_per_mm: float, most: int) -> tuple[int, ...]:
    """How often the resolution of each layer may be halved, the unblurred one included.

    Texels twice as large need a blur four times as wide: what they lose in the sparse parts of a map is then
    as small a part of the image (docs/performance.md has the errors).

    variance_mm2 : of the blurred layers, increasing
    texels_per_mm : of the map
    """
    found = [0]
    for before in (0.0, *variance_mm2[:-1]):
        smooth = texels_per_mm * math.sqrt(math.sqrt(before) / SHARP)
        finest, coarsest = found[-1], min(most, found[-1] + 1)
        found.append(int(min(max(math.log2(max(smooth, 1.0)), finest), coarsest)))
    return tuple(found)
