"""Textures, buffers and samplers described for another program, and what they hold."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.gpu.device import Device
from dermis.gpu.textures import download


def described(device: Device, value: Any) -> dict[str, Any]:
    """What it takes to make a resource: its kind, sizes and uses by WebGPU's numbers, or options."""
    if hasattr(value, "mip_level_count"):
        return {
            "kind": "texture",
            "format": value.format,
            "size": list(value.size),
            "mips": value.mip_level_count,
            "usage": int(value.usage),
        }
    if hasattr(value, "size"):
        return {"kind": "buffer", "size": value.size, "usage": int(value.usage)}
    return {"kind": "sampler", "options": device.sampler_options(value)}


def content_of(device: Device, value: Any) -> list[NDArray[np.uint8]]:
    """The bytes of a buffer, or of a texture's layers, mip by mip and in a mip layer by layer."""
    if not hasattr(value, "mip_level_count"):
        return [np.frombuffer(device.handle.queue.read_buffer(value), np.uint8)]
    layers = range(value.size[2])
    texels = [
        download(device, value, mip=mip, layer=layer)
        for mip in range(value.mip_level_count)
        for layer in layers
    ]
    return [np.ascontiguousarray(one).view(np.uint8).reshape(-1) for one in texels]
