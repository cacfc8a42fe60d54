"""Blend of diffusion profiles by a map: blend weights over the atlas, and the light of each profile."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.reading import checked_path
from dermis.formats.maps import mixture_map
from dermis.frame.features.atlas.lit_atlas import LitAtlas
from dermis.frame.features.atlas.passes import draw_gutters
from dermis.frame.features.diffusion.pyramid import PyramidLevels
from dermis.frame.programs import FLOAT_TEXEL_FORMAT, HALF_TEXEL_FORMAT, TILE_SIDE, program
from dermis.gpu import Bindings, Device, Recorder, Texture, TextureView, make_texture, upload
from dermis.gpu.textures import make_view
from dermis.images.filters import mip_chain

_CACHED_BLEND_MAP_COUNT = 4


@dataclass(frozen=True, eq=False)
class ProfileMixture:
    """Textures for skin where a map blends a first profile with one or two others.

    uv_weights : texture over uv of the blend weights of all profiles but the first
    entering_light : for each profile but the first, the blur pyramid of the light that enters the skin,
        multiplied by the blend weight of the profile
    atlas_weights : for each atlas layout, a texture over the atlas of the same blend weights
    sums : texture array. Layer 0 is the exitance of skin that has the first profile everywhere. Two layers
        follow for each other profile. Both hold the light diffused by this profile minus the light diffused
        by the first profile: the first of the two layers is computed from all light that enters the skin, the
        second from the weighted light in `entering_light`
    """

    uv_weights: Texture
    entering_light: tuple[PyramidLevels, ...]
    atlas_weights: tuple[Texture, ...]
    sums: Texture
    _views: dict[int, TextureView] = field(default_factory=dict)

    def sum_layer(self, layer_index: int) -> TextureView:
        """Return a view of one layer of `sums`."""
        if layer_index not in self._views:
            self._views[layer_index] = make_view(self.sums, layer=layer_index)
        return self._views[layer_index]


def make_profile_mixture(
    device: Device, uv_weights: Texture, entering_light_pyramids: tuple[PyramidLevels, ...], layout_count: int
) -> ProfileMixture:
    """Allocate the textures of a mixture of profiles.

    uv_weights : texture over uv of the blend weights
    entering_light_pyramids : for each profile but the first, the pyramid in which the light that enters the
        skin is blurred, after it is multiplied by the blend weight of the profile
    layout_count : number of atlas layouts
    """
    side, texel_format = entering_light_pyramids[0].size, entering_light_pyramids[0].texel_format
    atlas_weights = tuple(
        make_texture(device, (side, side), texel_format, texture_name="shares of profiles")
        for _ in range(layout_count)
    )
    layers = layer_count_of_sums(len(entering_light_pyramids))
    sums = make_texture(
        device, (side, side), FLOAT_TEXEL_FORMAT, layer_count=layers, texture_name="light of mixed profiles"
    )
    return ProfileMixture(uv_weights, entering_light_pyramids, atlas_weights, sums)


def layer_count_of_sums(other_profile_count: int) -> int:
    """Return the number of layers of `ProfileMixture.sums`.

    other_profile_count : number of profiles besides the first
    """
    return 1 + 2 * other_profile_count


def upload_blend_weights(device: Device, blend_weights: NDArray[np.float32]) -> Texture:
    """Upload the (h, w, 2) blend weights of the second and third profile as a texture with all mip levels."""
    height, width = blend_weights.shape[:2]
    mips = mip_chain(np.pad(blend_weights, ((0, 0), (0, 0), (0, 2))))
    texture = make_texture(
        device, (width, height), HALF_TEXEL_FORMAT, mip_count=len(mips), content_source="map"
    )
    for mip, pixels in enumerate(mips):
        upload(device, texture, pixels, mip=mip)
    return texture


def load_blend_weights(image_path: str) -> NDArray[np.float32]:
    """Return the (h, w, 2) blend weights of an image file; the result is cached until the file changes.

    image_path : path of the image

    Raises DermisError for a file that is missing or is not an image of blend weights.
    """
    path = checked_path(image_path, "a map of profiles")
    try:
        status = path.stat()
    except (OSError, ValueError):
        expected = "a picture: grey, or red and green"
        refuse(f"profile map {image_path}", expected, "there is no such file", "Check the name")
    return _load_blend_map(path, (status.st_mtime_ns, status.st_size, status.st_ino))


@lru_cache(_CACHED_BLEND_MAP_COUNT)
def _load_blend_map(path: Path, _: tuple[int, ...]) -> NDArray[np.float32]:
    return mixture_map(path)


def draw_blend_weights(graph: Recorder, layout: LitAtlas, mixture: ProfileMixture, layout_index: int) -> None:
    """Declare the passes that resample the blend weights from uv to the atlas, gutters included.

    layout_index : index of the atlas layout
    """
    into, texel_format = mixture.atlas_weights[layout_index], mixture.entering_light[0].texel_format
    bindings: Bindings = {
        **layout.bindings,
        **layout.atlas.resources,
        "weight_map": mixture.uv_weights,
        "stored": into,
    }
    shader = program(graph.device, "diffusion/profile_blend_weights.wgsl", store_format=texel_format)
    graph.compute("profiles", shader, bindings, into.size[:2])
    draw_gutters(graph, "profiles", layout.atlas, into, texel_format)


def draw_entering_light(
    graph: Recorder, levels: PyramidLevels, mixture: ProfileMixture, layout_index: int, profile_index: int
) -> None:
    """Declare the pass that multiplies the light that enters the skin by the blend weight of a profile.

    The product is stored in level 0 of that profile's own blur pyramid, in `ProfileMixture.entering_light`.

    levels : blur pyramid whose level 0 is read; it holds all light that enters the skin
    layout_index : index of the atlas layout
    profile_index : index of the profile among all profiles but the first
    """
    entering, device, texel_format = mixture.entering_light[profile_index], graph.device, levels.texel_format
    shader = program(
        device, "diffusion/profile_entering.wgsl", (("OTHER", profile_index),), texel_format, texel_format
    )
    linear = device.sampler(mag_filter="linear", min_filter="linear")
    light = {"source": levels.layer(0), "stored": entering.layer(0)}
    bindings: Bindings = {**light, "linear": linear, "blend_weights": mixture.atlas_weights[layout_index]}
    graph.compute("profiles", shader, bindings, (levels.size,) * 2, TILE_SIDE)


def draw(graph: Recorder, mixture: ProfileMixture, layout_index: int, blended_exitance: Texture) -> None:
    """Declare the pass that combines the layers of `ProfileMixture.sums` into the exitance of the skin.

    The alpha channel of the result stores the blend weights, packed.

    layout_index : index of the atlas layout
    blended_exitance : texture for the result
    """
    shader = program(
        graph.device, "diffusion/profile_mixture.wgsl", (("OTHERS", len(mixture.entering_light)),)
    )
    weights = mixture.atlas_weights[layout_index]
    bindings: Bindings = {"sums": mixture.sums, "blend_weights": weights, "mixed": blended_exitance}
    graph.compute("profiles", shader, bindings, blended_exitance.size[:2], TILE_SIDE)
