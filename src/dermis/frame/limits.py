"""Refuses frames that exceed the limits of a device, before anything is allocated."""

from __future__ import annotations

from dermis.errors import refuse
from dermis.frame.passes.surface_texels import SURFACE_BYTES
from dermis.frame.seams import LaidOut
from dermis.frame.techniques.technique import Technique
from dermis.gpu import Device
from dermis.gpu.memory import check_memory
from dermis.scene.settings import Settings

_DISTANCE = 4  # bytes of a texel: distance to the edge of its chart
_FLOATS = 16  # bytes of a texel: four floats
_GEOMETRY = 8 + 8 + 8  # bytes of an atlas texel: place on the mesh, stretch, reach
_PICTURE = 36  # bytes of a pixel
_SAMPLE = 8


def check_limits(
    device: Device, technique: Technique, settings: Settings, atlases: LaidOut, levels: int
) -> None:
    """Raises DermisError for sizes over the device's limits.

    levels : number of Gaussians that blur light over the atlas
    """
    limit, name = device.max_texture_size, device.adapter.name
    sides = {"size": max(settings.size), "atlas": atlases.side, "shadow_size": settings.shadow_size}
    for option, side in sides.items():
        if side > limit:
            name_limit = f"at most {limit} (the limit of {name})"
            refuse(option, name_limit, f"it is {side}", "Choose a smaller one")
    width, height = settings.size
    pixel = _PICTURE + _SAMPLE * settings.samples + technique.pixel_bytes
    texel = atlas_texel_bytes(technique, levels, len(atlases.layouts))
    sizes = f"{atlases.side} texels and {width}x{height} pixels"
    check_memory(device, texel * atlases.side**2 + pixel * width * height, "atlas and size", sizes)


def atlas_texel_bytes(technique: Technique, levels: int, layouts: int) -> float:
    """Bytes of an atlas texel on a software adapter: geometry, levels, light between passes, their sum.

    levels : number of Gaussians that blur light
    layouts : number of atlases of that size
    """
    if not levels:
        return layouts * _GEOMETRY
    blurs = technique.texel_bytes(levels)
    blended = _FLOATS + layouts * _DISTANCE if layouts > 1 else 0
    return blurs + blended + layouts * (_GEOMETRY + SURFACE_BYTES + _FLOATS)
