"""Frames that a device cannot hold are refused before anything is made for them."""

from __future__ import annotations

import os

from dermis.errors import refuse
from dermis.gpu import Device
from dermis.scene.settings import Settings

_ATLAS_BYTES = 9 * 16  # a texel of six levels, their sum, the space between passes, and its geometry


def check_limits(device: Device, settings: Settings) -> None:
    """Raises DermisError for sizes over the device's limits."""
    limit, name = device.max_texture_size, device.adapter.name
    sides = {"size": max(settings.size), "atlas": settings.atlas, "shadow_size": settings.shadow_size}
    for option, side in sides.items():
        if side > limit:
            name_limit = f"at most {limit} (the limit of {name})"
            refuse(option, name_limit, f"it is {side}", "Choose a smaller one")
    if device.adapter.kind == "CPU" and hasattr(os, "sysconf"):
        _check_memory(settings)


def _check_memory(settings: Settings) -> None:
    """A software adapter takes textures from main memory, and the system ends who takes too much."""
    width, height = settings.size
    needed = _ATLAS_BYTES * settings.atlas**2 + (36 + 8 * settings.samples) * width * height
    here = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if needed > here:
        sizes = f"{settings.atlas} texels and {width}x{height} pixels need {needed / 1e9:.0f} GB"
        refuse("atlas and size", f"a frame within {here / 1e9:.0f} GB", sizes, "Choose smaller ones")
