"""Frames that a device cannot hold are refused before anything is made for them."""

from __future__ import annotations

import os

from dermis.errors import refuse
from dermis.gpu import Device
from dermis.scene.settings import Settings

_DEPTH_BYTES = 4
_ATLAS_BYTES = 9 * 16  # a texel of six levels, their sum, the space between passes, and its geometry


def check_limits(device: Device, settings: Settings) -> None:
    """Raises DermisError for sizes over the device's limits."""
    limit, name = device.max_texture_size, device.adapter.name
    sides = {"size": max(settings.size), "atlas": settings.atlas, "shadow_size": settings.shadow_size}
    for option, side in sides.items():
        if side > limit:
            name_limit = f"at most {limit} (the limit of {name})"
            refuse(option, name_limit, f"it is {side}", "Choose a smaller one")
    width, height = settings.size
    needed = _ATLAS_BYTES * settings.atlas**2 + (36 + 8 * settings.samples) * width * height
    _check_memory(device, needed, "atlas and size", f"{settings.atlas} texels and {width}x{height} pixels")


def check_shadows(device: Device, layers: int, size: int) -> None:
    """Raises DermisError for shadow maps that do not fit into memory."""
    _check_memory(device, _DEPTH_BYTES * layers * size**2, "shadow_size", f"{layers} maps of {size} texels")


def _check_memory(device: Device, needed: int, option: str, sizes: str) -> None:
    """A software adapter takes textures from main memory, and the system ends who takes too much."""
    if device.adapter.kind != "CPU" or not hasattr(os, "sysconf"):
        return
    here = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if needed > here:
        came = f"{sizes} need {needed / 1e9:.0f} GB"
        refuse(option, f"a frame within {here / 1e9:.0f} GB", came, "Choose smaller ones")
