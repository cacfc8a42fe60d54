"""Maps with mip levels, which the device computes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.frame.programs import HALF_TEXEL_FORMAT, program
from dermis.gpu import (
    Bindings,
    Buffer,
    CommandList,
    Device,
    Recorder,
    Texture,
    TextureView,
    make_texture,
    upload,
)
from dermis.gpu.textures import make_view, texture_from_array
from dermis.images.filters import mip_chain

Floats = NDArray[np.float32]
_RELIEF_ROWS_PER_INVOCATION = 32  # rows per invocation of relief.wgsl
_MAX_BAND_BYTES = 96 << 20  # largest size of the heights of a pass; every device can bind such a buffer


class MippedTexture(NamedTuple):
    """Texture with a view of each mip level, the finest first."""

    texture: Texture
    levels: tuple[TextureView, ...]

    @property
    def size(self) -> tuple[int, int]:
        """Return the width and height of the finest level [texels]."""
        width, height = self.texture.size[:2]
        return width, height


def upload_colours(device: Device, colour_map: Floats) -> Texture:
    """Upload an (h, w, 3) colour map as half floats with all mip levels."""
    mipped = empty_map(device, colour_map.shape)
    alpha = np.ones(colour_map.shape[:2], np.float16)
    upload(device, mipped.texture, np.dstack([colour_map.astype(np.float16), alpha]))
    frame = CommandList(device, timed=False)
    fill_mips(frame, mipped)
    frame.submit()
    return mipped.texture


def upload_slopes(device: Device, slopes: Floats | None) -> Texture:
    """Upload (h, w, 2) slopes and their squares, with mip levels that give the variance of slopes.

    slopes : slopes along u and v, None for a flat texture
    """
    if slopes is None:
        return _flat_relief(device)
    mipped, frame = empty_map(device, slopes.shape), CommandList(device, timed=False)
    bound: Bindings = {"slopes": texture_from_array(device, slopes, "rg32float"), "stored": mipped.levels[0]}
    shader = program(device, "surface/map_moments.wgsl", store_format=HALF_TEXEL_FORMAT)
    frame.compute("maps", shader, bound, slopes.shape[1::-1])
    fill_mips(frame, mipped)
    frame.submit()
    return mipped.texture


def upload_detail(device: Device, slopes: Floats, cavities: Floats) -> Texture:
    """Upload the slopes of two tiling reliefs as one layer, their squared lengths and cavities as another.

    slopes : (h, w, 4) slopes along u and v of the first relief, then of the second relief
    cavities : (h, w, 2) cavities of both reliefs
    """
    squares = slopes * slopes
    sums = np.stack([squares[..., 0] + squares[..., 1], squares[..., 2] + squares[..., 3]], axis=-1)
    return upload_layers(device, [slopes, np.dstack([sums, cavities])], "texture")


def upload_layers(device: Device, layer_maps: Sequence[Floats], texture_name: str) -> Texture:
    """Upload (h, w, 4) maps of equal size as the layers of a half-float texture with all mip levels.

    texture_name : name of the texture, for error messages
    """
    height, width = layer_maps[0].shape[:2]
    mips = max(height, width).bit_length()
    texture = make_texture(
        device,
        (width, height),
        HALF_TEXEL_FORMAT,
        layer_count=len(layer_maps),
        mip_count=mips,
        content_source="map",
        texture_name=texture_name,
    )
    for layer, texels in enumerate(layer_maps):
        for mip, level in enumerate(mip_chain(texels)):
            upload(device, texture, level, mip=mip, layer=layer)
    return texture


def make_relief(device: Device, height_map: Floats | None) -> Texture:
    """Compute a texture of slopes and squared slopes from a height map, with all mip levels.

    height_map : (h, w) heights, None for a flat texture

    Heights are extrapolated linearly beyond the edges.
    """
    if height_map is None or height_map.size == 1:
        return _flat_relief(device)
    padded = np.pad(height_map, 1, "reflect", reflect_type="odd")
    band = (
        max(_MAX_BAND_BYTES // padded[:1].nbytes // _RELIEF_ROWS_PER_INVOCATION, 1)
        * _RELIEF_ROWS_PER_INVOCATION
    )
    bands = (
        device.buffer(padded[top : top + band + 2], "STORAGE") for top in range(0, len(height_map), band)
    )
    return relief_from_buffers(device, bands, height_map.shape, band)


def relief_from_buffers(
    device: Device, height_bands: Iterable[Buffer], map_shape: tuple[int, ...], rows_per_band: int
) -> Texture:
    """Compute a texture of slopes and squared slopes from a height map in several buffers.

    height_bands : buffers of consecutive rows, with a border of one texel on all sides
    map_shape : (h, w) of the height map
    rows_per_band : number of rows per buffer
    """
    mipped, frame, (rows, columns) = empty_map(device, map_shape), CommandList(device, timed=False), map_shape
    for index, heights in enumerate(height_bands):
        _draw_slopes(
            frame, mipped, heights, index * rows_per_band, min(rows_per_band, rows - index * rows_per_band)
        )
    fill_mips(frame, mipped, 1 if rows % 2 or columns % 2 else 2)
    frame.submit()
    return mipped.texture


def fill_relief(recorder: Recorder, relief_texture: MippedTexture, height_buffer: Buffer) -> None:
    """Declare the passes that fill a relief texture from the heights in one buffer.

    relief_texture : texture for slopes and squared slopes; its width and height are even numbers of texels
    height_buffer : buffer of heights with a border of one texel on all sides [mm]
    """
    _draw_slopes(recorder, relief_texture, height_buffer, 0, relief_texture.size[1])
    fill_mips(recorder, relief_texture, 2)


def _draw_slopes(
    recorder: Recorder, relief_texture: MippedTexture, height_buffer: Buffer, first_row: int, row_count: int
) -> None:
    device = recorder.device
    first = device.cached(
        f"relief from row {first_row}", lambda: device.buffer(np.array([first_row], np.uint32), "STORAGE")
    )
    bound: Bindings = {
        "top": first,
        "heights": height_buffer,
        "stored": relief_texture.levels[0],
        "halved": relief_texture.levels[1],
    }
    size = -(-relief_texture.size[0] // 2), -(-row_count // _RELIEF_ROWS_PER_INVOCATION)
    recorder.compute(
        "maps", program(device, "surface/relief.wgsl", store_format=HALF_TEXEL_FORMAT), bound, size
    )


def _flat_relief(device: Device) -> Texture:
    return device.cached(
        "no relief", lambda: make_texture(device, (1, 1), HALF_TEXEL_FORMAT, content_source="map")
    )


def empty_map(device: Device, map_shape: tuple[int, ...]) -> MippedTexture:
    """Allocate an (h, w) map of half floats with all mip levels."""
    mips = max(map_shape[:2]).bit_length()
    texture = make_texture(
        device, (map_shape[1], map_shape[0]), HALF_TEXEL_FORMAT, mip_count=mips, texture_name="painted map"
    )
    return with_mip_views(texture)


def with_mip_views(texture: Texture) -> MippedTexture:
    """Return a texture together with a view of each of its mip levels."""
    return MippedTexture(
        texture, tuple(make_view(texture, mip=mip) for mip in range(texture.mip_level_count))
    )


def fill_mips(recorder: Recorder, mipped_texture: MippedTexture, first_level: int = 1) -> None:
    """Declare the passes that compute each mip level from the next finer mip level.

    first_level : index of the first level to compute
    """
    shader, levels = (
        program(recorder.device, "surface/map_halve.wgsl", store_format=HALF_TEXEL_FORMAT),
        mipped_texture.levels,
    )
    width, height = mipped_texture.size
    for mip in range(first_level, len(levels)):
        bound: Bindings = {"finer": levels[mip - 1], "stored": levels[mip]}
        recorder.compute("maps", shader, bound, (max(width >> mip, 1), max(height >> mip, 1)))
