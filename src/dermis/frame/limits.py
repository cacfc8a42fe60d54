"""Limits of a device: frames that exceed them are refused, with settings that would fit."""

from __future__ import annotations

import traceback
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from dermis.base.errors import refuse
from dermis.frame.features.diffusion.mixture import sums_of
from dermis.frame.features.shadows.shadows import SHADOW_BYTES
from dermis.frame.features.surface.texels import SURFACE_BYTES
from dermis.frame.request import FrameRequest
from dermis.frame.technique import TechniqueTraits
from dermis.gpu import Device
from dermis.gpu.memory import OutOfMemoryError, allocated_bytes, check_memory, format_bytes, probe_memory
from dermis.scene.settings import Settings

_DISTANCE = 4  # bytes of a texel: distance to the edge of its chart
_FLOATS = 16  # bytes of a texel: four floats
_GEOMETRY = 8 + 8 + 8  # bytes of an atlas texel: place on the mesh, stretch, reach
_PICTURE = 36  # bytes of a pixel
_SAMPLE = 8
_NUMBER = 2 * 4  # bytes of a pixel for each number of an output, and those of its copy for reading
_FEW_SAMPLES = 4  # of a pixel, below which edges are rough
_SHARE = 0.75  # of the room that was found: the head, its maps and programs take some
_LEAST = 64  # of a side, below which nothing is won


def check_limits(device: Device, request: FrameRequest) -> None:
    """Raises DermisError for sizes over the device's limits."""
    limit, name, settings = device.max_texture_size, device.adapter.name, request.settings
    sides = {"size": max(settings.size), "atlas": request.atlases.side, "shadow_size": settings.shadow_size}
    for option, side in sides.items():
        if side > limit:
            name_limit = f"at most {limit} (the limit of {name})"
            refuse(option, name_limit, f"it is {side}", "Choose a smaller one")
    needed = frame_bytes(request)
    width, height = settings.size
    sizes = f"{request.atlases.side} texels and {width}x{height} pixels"
    of_both = needed["atlas"] + needed["size"]
    check_memory(device, of_both, "atlas and size", sizes, partial(fitting, request))


def no_room(error: OutOfMemoryError, device: Device, request: FrameRequest) -> OutOfMemoryError:
    """The same error, with what would fit in place of what did not; what was made of that is released."""
    for one in filter(None, (error, error.__cause__)):
        traceback.clear_frames(one.__traceback__)
    needed = sum(frame_bytes(request).values())
    found = probe_memory(device, needed)
    most = _SHARE * (allocated_bytes() + found)
    if needed <= most:  # and yet it did not fit: others of this process hold the rest
        most = _SHARE * found
    return OutOfMemoryError(error.expected, error.came, error.size, fitting(request, most))


def fitting(request: FrameRequest, most: float) -> str:
    """What to write for a frame to take no more than a number of bytes: halves of what takes most of it."""
    smaller, changed = request, dict[str, str]()
    needed = frame_bytes(request)
    while sum(needed.values()) > most:
        option = max(needed, key=lambda name: needed[name])
        halved = _halved(smaller.settings, option)
        if halved is None:
            break
        smaller = replace(smaller, settings=halved)
        needed, changed = frame_bytes(smaller), changed | _written(halved, option)
    if not changed or sum(needed.values()) > most:
        return "Close other programs that use the memory, or try --adapter cpu"
    return f"With {' '.join(changed.values())} it takes about {format_bytes(sum(needed.values()))}"


def frame_bytes(request: FrameRequest) -> dict[str, float]:
    """Bytes that a frame takes, by the option that they follow from; the head and its maps aside."""
    technique, settings, atlases = request.technique, request.settings, request.atlases
    width, height = settings.size
    pixel = _PICTURE + _SAMPLE * settings.samples + technique.pixel_bytes
    pixel += _NUMBER * sum(request.output_channels.values())
    pixel += technique.apart_bytes * ("diffuse" in request.outputs)
    texel = atlas_texel_bytes(technique, request.count, len(atlases.layouts))
    texel += _mixing_bytes(request) if request.count else 0.0
    if "translucent" in request.outputs:
        texel += _FLOATS * (2 * len(atlases.layouts) - 1)
    return {
        "atlas": texel * atlases.side**2,
        "size": float(pixel * width * height),
        "shadow_size": float(SHADOW_BYTES * request.shadow_layers * settings.shadow_size**2),
    }


def _mixing_bytes(request: FrameRequest) -> float:
    """Of a texel of the atlas, where a map mixes profiles: levels of each other, shares and sums."""
    others = len(request.others)
    shares = len(request.atlases.layouts) + sums_of(others)
    return others * request.technique.texel_bytes(request.count) + _FLOATS * shares if others else 0.0


def _halved(settings: Settings, option: str) -> Settings | None:
    """Settings with half of an option, None where that is too little: of the size, samples first."""
    if option == "size" and settings.samples > _FEW_SAMPLES:
        return settings.model_copy(update={"samples": settings.samples // 2})
    value: Any = getattr(settings, option)
    half: Any = tuple(side // 2 for side in value) if option == "size" else value // 2
    return settings.model_copy(update={option: half}) if np.min(half) >= _LEAST else None


def _written(settings: Settings, option: str) -> dict[str, str]:
    """Options of the command line, by their names."""
    if option != "size":
        return {option: f"--{option.replace('_', '-')} {getattr(settings, option)}"}
    width, height = settings.size
    return {"size": f"--size {width}x{height} --samples {settings.samples}"}


def atlas_texel_bytes(technique: TechniqueTraits, levels: int, layouts: int) -> float:
    """Bytes of an atlas texel on a software adapter: geometry, levels, light between passes, their sum.

    levels : number of Gaussians that blur light
    layouts : number of atlases of that size
    """
    if not levels:
        return layouts * _GEOMETRY
    blurs = technique.texel_bytes(levels)
    blended = _FLOATS + layouts * _DISTANCE if layouts > 1 else 0
    return blurs + blended + layouts * (_GEOMETRY + SURFACE_BYTES + _FLOATS)
