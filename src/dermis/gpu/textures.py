"""Creation, upload and download of textures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import DermisError
from dermis.gpu.command_list import CommandList
from dermis.gpu.device import Device
from dermis.gpu.memory import checked_allocation
from dermis.gpu.program import ComputeProgram
from dermis.gpu.types import Texture, TextureView

_TEXEL_FORMATS: dict[str, tuple[type[np.generic], int]] = {
    "r8unorm": (np.uint8, 1),
    "rgba8unorm": (np.uint8, 4),
    "rgba8unorm-srgb": (np.uint8, 4),
    "rgba8uint": (np.uint8, 4),
    "r16float": (np.float16, 1),
    "rg16float": (np.float16, 2),
    "rgba16float": (np.float16, 4),
    "r32float": (np.float32, 1),
    "rg32float": (np.float32, 2),
    "rgba32float": (np.float32, 4),
    "r32uint": (np.uint32, 1),
    "rg32uint": (np.uint32, 2),
    "rgba32uint": (np.uint32, 4),
    "rgba16uint": (np.uint16, 4),
    "depth32float": (np.float32, 1),
}

TEXEL_FORMAT_BYTES = {
    name: np.dtype(kind).itemsize * channels for name, (kind, channels) in _TEXEL_FORMATS.items()
}
"""Size of a texel in each format [byte]."""

_LARGE_UPLOAD_BYTES = 1 << 24  # bytes

_ROUNDING_PROBE_SIDE = 64


def make_texture(
    device: Device,
    size: tuple[int, int],
    texel_format: str,
    *,
    layer_count: int = 1,
    mip_count: int = 1,
    content_source: str = "compute",
    texture_name: str = "texture",
) -> Texture:
    """Create an empty 2-D texture, or a texture array if `layer_count` > 1.

    size : width and height [texel]
    texel_format : wgpu's name of the texel format, such as "rgba16float"
    mip_count : number of mip levels
    content_source : how the texture gets its content: "compute" (storage texture), "raster" (render target)
        or "map" (upload); shaders can read every texture
    texture_name : name of the texture, for error messages

    Raises DermisError for sizes over the device's limit, and OutOfMemoryError if the device's memory is full.
    """
    import wgpu

    if max(size) > device.max_texture_size or min(size) < 1:
        raise DermisError(
            f"{texture_name} of {size[0]}x{size[1]}: expected sides from 1 to {device.max_texture_size} "
            f"(the limit of {device.adapter.name}), but that is outside. Choose a smaller size."
        )
    usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_SRC
    usage |= {
        "compute": wgpu.TextureUsage.STORAGE_BINDING | wgpu.TextureUsage.COPY_DST,
        "raster": wgpu.TextureUsage.RENDER_ATTACHMENT,
        "map": wgpu.TextureUsage.COPY_DST,
    }[content_source]
    description = f"{texture_name} of {size[0]}x{size[1]}x{layer_count} {texel_format}"
    texels = layer_count * sum(max(1, size[0] >> mip) * max(1, size[1] >> mip) for mip in range(mip_count))
    with checked_allocation(
        device.adapter.name, description, TEXEL_FORMAT_BYTES[texel_format] * texels, math.inf
    ):
        texture: Texture = device.handle.create_texture(
            size=(*size, layer_count),
            format=texel_format,
            usage=usage,
            mip_level_count=mip_count,
            dimension="2d",
        )
    return texture


def make_view(texture: Texture, *, layer: int = 0, mip: int = 0) -> TextureView:
    """Create a 2-D view of one mip level of one layer of a texture."""
    view = texture.create_view(
        dimension="2d", base_array_layer=layer, array_layer_count=1, base_mip_level=mip, mip_level_count=1
    )
    view.layer_and_mip = layer, mip
    return view


def upload(
    device: Device, texture: Texture, texels: NDArray[np.generic], *, mip: int = 0, layer: int = 0
) -> None:
    """Write an array (h, w) or (h, w, c) to one mip level of one layer of a texture."""
    kind, channels = _TEXEL_FORMATS[texture.format]
    data = np.ascontiguousarray(texels, dtype=kind)
    height, width = data.shape[:2]
    device.handle.queue.write_texture(
        {"texture": texture, "mip_level": mip, "origin": (0, 0, layer)},
        data,
        {"bytes_per_row": width * channels * data.itemsize, "rows_per_image": height},
        (width, height, 1),
    )
    if data.nbytes > _LARGE_UPLOAD_BYTES:
        device.handle.queue.submit([])  # starts the copy while Python goes on


def texel_bytes(texture: Texture) -> int:
    """Return the size of one texel of a texture [byte]."""
    return TEXEL_FORMAT_BYTES[texture.format]


def texture_from_array(
    device: Device, texels: NDArray[np.generic], texel_format: str, texture_name: str = "texture"
) -> Texture:
    """Create a texture from an array (h, w) or (h, w, c), for reading in shaders.

    texel_format : wgpu's name of the texel format, such as "rgba16float"
    texture_name : name of the texture, for error messages
    """
    texture = make_texture(
        device,
        (texels.shape[1], texels.shape[0]),
        texel_format,
        content_source="map",
        texture_name=texture_name,
    )
    upload(device, texture, texels)
    return texture


def download(device: Device, texture: Texture, *, mip: int = 0, layer: int = 0) -> NDArray[Any]:
    """Return one mip level of one layer of a texture as an array (h, w, c), or (h, w) for one channel."""
    kind, channels = _TEXEL_FORMATS[texture.format]
    width, height = max(1, texture.size[0] >> mip), max(1, texture.size[1] >> mip)
    pitch = width * channels * np.dtype(kind).itemsize
    aligned = -(-pitch // 256) * 256  # WebGPU copies rows at multiples of 256 bytes
    data = device.handle.queue.read_texture(
        {"texture": texture, "mip_level": mip, "origin": (0, 0, layer)},
        {"bytes_per_row": aligned, "rows_per_image": height},
        (width, height, 1),
    )
    rows = np.frombuffer(data, dtype=np.uint8)
    rows = rows.reshape(height, -1)[:, :pitch]
    texels = np.ascontiguousarray(rows).view(kind)
    return texels.reshape((height, width, channels) if channels > 1 else (height, width))


def float16_store_rounding(device: Device) -> str:
    """Return how a device rounds stores to rgba16float textures: "nearest", "toward zero" or "other"."""
    program = ComputeProgram(device, Path(__file__).parent / "wgsl" / "store_probe.wgsl")
    texture = make_texture(device, (_ROUNDING_PROBE_SIDE, _ROUNDING_PROBE_SIDE), "rgba16float")
    frame = CommandList(device)
    size = np.array([_ROUNDING_PROBE_SIDE, _ROUNDING_PROBE_SIDE, 0, 0], np.uint32)
    frame.compute(
        "probe", program, {"size": size, "rounded": texture}, (_ROUNDING_PROBE_SIDE, _ROUNDING_PROBE_SIDE)
    )
    frame.submit()
    stored = download(device, texture)[..., 0].astype(np.float64).ravel()
    exact = 1.0 + np.arange(_ROUNDING_PROBE_SIDE * _ROUNDING_PROBE_SIDE) / 65536.0
    if np.array_equal(stored, exact.astype(np.float16).astype(np.float64)):
        return "nearest"
    down = 1.0 + np.floor((exact - 1.0) * 1024.0) / 1024.0  # halves are 1/1024 apart above 1
    return "toward zero" if np.array_equal(stored, down) else "other"
