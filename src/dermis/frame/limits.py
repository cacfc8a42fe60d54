"""Frames that a device cannot hold are refused before anything is made for them."""

from __future__ import annotations

import os

from dermis.errors import refuse
from dermis.frame.levels import MOST_HALVINGS
from dermis.frame.passes.surface_texels import SURFACE_BYTES
from dermis.frame.seams import LaidOut
from dermis.gpu import Device
from dermis.scene.settings import Settings

_DEPTH_BYTES = 4
_DISTANCE = 4  # of a texel: to the edge of its chart
_FLOATS, _HALVES = 16, 8  # of a texel
_GEOMETRY = 8 + 8 + 16  # of a texel of an atlas: place on the mesh, stretch, both with reach
_PICTURE, _APART = 36, 64  # of a pixel; of one whose light below is kept apart
_SAMPLE = 8


def check_limits(device: Device, settings: Settings, atlases: LaidOut, levels: int) -> None:
    """Raises DermisError for sizes over the device's limits.

    levels : Gaussians that light is blurred by over the atlas, 0 when there is none
    """
    limit, name = device.max_texture_size, device.adapter.name
    sides = {"size": max(settings.size), "atlas": atlases.side, "shadow_size": settings.shadow_size}
    for option, side in sides.items():
        if side > limit:
            name_limit = f"at most {limit} (the limit of {name})"
            refuse(option, name_limit, f"it is {side}", "Choose a smaller one")
    width, height = settings.size
    pixel = _PICTURE + _SAMPLE * settings.samples + _APART * (settings.technique == "screen-space")
    texel = atlas_texel_bytes(settings.technique, levels, len(atlases.layouts))
    sizes = f"{atlases.side} texels and {width}x{height} pixels"
    _check_memory(device, texel * atlases.side**2 + pixel * width * height, "atlas and size", sizes)


def atlas_texel_bytes(technique: str, levels: int, layouts: int) -> float:
    """Bytes of a texel of the atlas on a software adapter: geometry, levels, space between passes, their sum.

    levels : Gaussians that light is blurred by
    layouts : atlases of that size
    """
    if not levels:
        return layouts * _GEOMETRY
    if technique == "gpu-gems-3":  # besides, a stretch map between passes
        blurs = float(_HALVES * (levels + 2) + 2 * _HALVES)
    else:
        blurs = _FLOATS * (levels + 2) * sum(0.25**halving for halving in range(MOST_HALVINGS + 1))
    blended = _FLOATS + layouts * _DISTANCE if layouts > 1 else 0
    return blurs + blended + layouts * (_GEOMETRY + SURFACE_BYTES + _FLOATS)


def check_shadows(device: Device, layers: int, size: int) -> None:
    """Raises DermisError for shadow maps that do not fit into memory."""
    _check_memory(device, _DEPTH_BYTES * layers * size**2, "shadow_size", f"{layers} maps of {size} texels")


def _check_memory(device: Device, needed: float, option: str, sizes: str) -> None:
    """A software adapter takes textures from main memory, and the system ends who takes too much."""
    if device.adapter.kind != "CPU" or not hasattr(os, "sysconf"):
        return
    here = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if needed > here:
        came = f"{sizes} need {needed / 1e9:.0f} GB"
        refuse(option, f"a frame within {here / 1e9:.0f} GB", came, "Choose smaller ones")
