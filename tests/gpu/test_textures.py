"""Upload and download of textures of all formats, widths, mip levels and layers."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.base.errors import DermisError
from dermis.gpu import Device, download, make_texture, upload
from dermis.gpu.textures import _TEXEL_FORMATS, texture_from_array

MAPS = sorted(set(_TEXEL_FORMATS) - {"depth32float"})  # depth is drawn, never uploaded


def noise(shape: tuple[int, int], texel: str, seed: int = 0) -> NDArray[np.generic]:
    kind, channels = _TEXEL_FORMATS[texel]
    full = (*shape, channels) if channels > 1 else shape
    numbers = np.random.default_rng(seed).uniform(0, 250, full)
    return numbers.astype(kind)


@pytest.mark.parametrize("texel", MAPS)
@pytest.mark.parametrize("size", [(64, 4), (67, 5), (1, 1), (3, 70)])
def test_upload_and_download_round_trip(device: Device, texel: str, size: tuple[int, int]) -> None:
    array = noise(size[::-1], texel)
    back = download(device, texture_from_array(device, array, texel))
    assert back.dtype == array.dtype
    assert np.array_equal(back, array)


@pytest.mark.parametrize("texel", ["rgba32float", "r16float", "rgba8unorm"])
def test_every_mip_is_uploaded(device: Device, texel: str) -> None:
    texture = make_texture(device, (37, 10), texel, mip_count=6, content_source="map")
    sizes = [(10, 37), (5, 18), (2, 9), (1, 4), (1, 2), (1, 1)]
    levels = [noise(size, texel, seed) for seed, size in enumerate(sizes)]
    for mip, level in enumerate(levels):
        upload(device, texture, level, mip=mip)
    assert all(np.array_equal(download(device, texture, mip=m), level) for m, level in enumerate(levels))


def test_every_layer_is_uploaded(device: Device) -> None:
    texture = make_texture(device, (13, 7), "rgba16float", layer_count=3, content_source="map")
    layers = [noise((7, 13), "rgba16float", seed) for seed in range(3)]
    for k in (2, 0, 1):
        upload(device, texture, layers[k], layer=k)
    assert all(np.array_equal(download(device, texture, layer=k), layers[k]) for k in range(3))


def test_view_of_an_array_uploads_only_its_values(device: Device) -> None:
    array = noise((20, 22), "r32float")[::2, 1::2]
    assert np.array_equal(download(device, texture_from_array(device, array, "r32float")), array)


def test_new_textures_are_black(device: Device) -> None:
    assert not download(device, make_texture(device, (9, 9), "rgba32float")).any()


@pytest.mark.parametrize("size", [(0, 4), (4, 0), (1 << 20, 4)])
def test_impossible_sizes_are_refused(device: Device, size: tuple[int, int]) -> None:
    with pytest.raises(DermisError, match=rf"texture of {size[0]}x{size[1]}.*{device.max_texture_size}"):
        make_texture(device, size, "r32float")
