"""Blur pyramid: textures, formats and resolutions of its levels."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dermis.frame.programs import FLOAT_TEXEL_FORMAT
from dermis.gpu import Device, Texture, TextureView, make_texture, mark_scratch
from dermis.gpu.textures import make_view

_MAX_SCALED_IRRADIANCE = 16.0  # sum of all lights after scaling, 1/4000 of the largest half float
_MAX_IRRADIANCE_SCALE = 2.0**100  # its inverse is a float too; for dimmer light the scale is limited
Floats = NDArray[np.float64]
Halvings = tuple[tuple[int, ...], ...]
"""For each atlas layout, the number of times that the resolution of each level is halved."""
MIN_SIGMA_PER_TEXEL_AREA = 0.45
"""Least blur of light that is stored at a reduced resolution [1/mm]: the standard deviation of the blur [mm],
divided by the squared side of a texel [mm^2]."""
MIN_WEIGHT_SUM = 1e-12
"""Lower limit of sums of weights in divisions, for channels without any weight."""


@dataclass(frozen=True, eq=False)
class PyramidLevels:
    """Textures of the blur pyramid: unblurred light as level 0, the blurred levels, and scratch space.

    stacks : one texture array for each resolution, finest first, with a layer for each level of that
        resolution. In all arrays but the first, layer 0 is a copy of the last layer of the previous array, at
        half its resolution
    first : for each array in `stacks`, the index of the level that layer 0 holds
    scratch : texture for light that is blurred along u but not yet along v
    size : side of the atlas at full resolution [texels]
    texel_format : texture format
    """

    stacks: tuple[Texture, ...]
    first: tuple[int, ...]
    scratch: Texture
    size: int
    texel_format: str
    _views: dict[tuple[int, int], TextureView] = field(default_factory=dict)

    def layer(self, level_index: int, halvings: int = 0) -> TextureView:
        """Return a view of one level, which is a layer of one of the texture arrays in `stacks`.

        level_index : index of the level in the pyramid
        halvings : number of times that the resolution is halved, which is the index of the array in `stacks`
        """
        if (level_index, halvings) not in self._views:
            layer = level_index - self.first[halvings]
            self._views[level_index, halvings] = make_view(self.stacks[halvings], layer=layer)
        return self._views[level_index, halvings]

    def scratch_view(self, halvings: int = 0) -> TextureView:
        """Return a view of the scratch texture at one resolution.

        halvings : number of times that the full resolution is halved
        """
        if (-1, halvings) not in self._views:
            self._views[-1, halvings] = make_view(self.scratch, mip=halvings)
        return self._views[-1, halvings]


@dataclass(frozen=True)
class Blur:
    """Gaussian blurs of one atlas layout.

    variance_mm2 : (k,) variances of the Gaussians, increasing [mm^2]
    weight : (k, 3) weights of the Gaussians for red, green and blue [-]
    halvings : (k + 1,) number of times that the resolution of each level is halved; level 0 is unblurred
    scale : factor that converts irradiance to the values stored in the levels
    edge : how blurs treat texels beyond a chart and its gutter: "repeated", "cleared" or "skipped"
    clear : irradiance that blurs read from empty texels if `edge` is "cleared"
    intermediate_levels : indices of levels without weight, which only serve as the source of wider blurs
    weight_differences : for each profile but the first, its (k, 3) weights minus the weights of the first
        profile
    """

    variance_mm2: Floats
    weight: Floats
    halvings: tuple[int, ...]
    scale: float = 1.0
    edge: str = "repeated"
    clear: tuple[float, float, float] = (0.0, 0.0, 0.0)
    intermediate_levels: tuple[int, ...] = ()
    weight_differences: tuple[Floats, ...] = ()

    @property
    def profile_levels(self) -> tuple[int, ...]:
        """Return the indices of the unblurred level 0, and of the blurred levels that the profile sums.

        The other levels are only intermediate steps towards wider blurs.
        """
        return tuple(k for k in range(len(self.halvings)) if k not in self.intermediate_levels)


def make_levels(device: Device, atlas_side: int, halvings: Halvings, texel_format: str) -> PyramidLevels:
    """Allocate the textures of a blur pyramid.

    atlas_side : side of the atlas at full resolution [texels]
    halvings : for each atlas layout, the number of times that the resolution of each level is halved
    texel_format : texture format
    """
    ranges = levels_by_resolution(halvings)
    stacks = tuple(
        make_texture(
            device,
            (atlas_side >> times,) * 2,
            texel_format,
            layer_count=len(levels),
            texture_name="blurred light",
        )
        for times, levels in enumerate(ranges)
    )
    between = mark_scratch(
        device,
        make_texture(
            device,
            (atlas_side, atlas_side),
            texel_format,
            mip_count=len(ranges),
            texture_name="light between two blurs",
        ),
    )
    return PyramidLevels(stacks, tuple(levels.start for levels in ranges), between, atlas_side, texel_format)


def levels_by_resolution(halvings: Halvings) -> tuple[range, ...]:
    """Return the range of level indices that each resolution stores, finest resolution first.

    A range includes every level that any atlas layout stores at this resolution. Every range but the first
    begins with the last level of the previous range, because each resolution also stores a downsampled copy
    of that level.

    halvings : for each atlas layout, the number of times that the resolution of each level is halved
    """
    coarsest = max(map(max, halvings))
    return tuple(
        range(
            min(one.index(times) for one in halvings if times in one) - (times > 0),
            max(len(one) - one[::-1].index(times) for one in halvings if times in one),
        )
        for times in range(coarsest + 1)
    )


def half_precision_scale(texel_format: str, irradiance_sum: float) -> float:
    """Return the factor that brings irradiance into the range of half floats; 1 for 32-bit floats.

    texel_format : texture format of the levels
    irradiance_sum : sum of the irradiances of all lights and of the environment

    The factor is a power of two, so that scaling is exact.
    """
    if texel_format == FLOAT_TEXEL_FORMAT or irradiance_sum == 0.0:
        return 1.0
    return math.ldexp(0.5, math.frexp(min(_MAX_SCALED_IRRADIANCE / irradiance_sum, _MAX_IRRADIANCE_SCALE))[1])


def choose_halvings(
    variance_mm2: NDArray[np.float64], texels_per_mm: float, max_halvings: int
) -> tuple[int, ...]:
    """Return how many times the resolution of each level may be halved; level 0 is the unblurred light.

    variance_mm2 : (k,) increasing variances of the blurred levels [mm^2]
    texels_per_mm : texel density of the atlas at full resolution
    max_halvings : largest number of times that the resolution of any level may be halved

    A level is computed by blurring the previous level. Its resolution is halved once more than that of the
    previous level if the previous level is smooth enough, as set by `MIN_SIGMA_PER_TEXEL_AREA`.
    """
    halvings = [0]
    for source_mm2 in (0.0, *variance_mm2[:-1]):
        smooth = texels_per_mm * math.sqrt(math.sqrt(source_mm2) / MIN_SIGMA_PER_TEXEL_AREA)
        finest, coarsest = halvings[-1], min(max_halvings, halvings[-1] + 1)
        halvings.append(int(min(max(math.log2(max(smooth, 1.0)), finest), coarsest)))
    return tuple(halvings)
