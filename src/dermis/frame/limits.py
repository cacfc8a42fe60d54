"""Memory and size limits of a device: larger frames are refused, with advice on settings that would fit."""

from __future__ import annotations

import traceback
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from dermis.base.errors import refuse
from dermis.frame.features.diffusion.mixture import layer_count_of_sums
from dermis.frame.features.shadows.shadows import SHADOW_TEXEL_BYTES
from dermis.frame.features.surface.texels import SURFACE_TEXEL_BYTES
from dermis.frame.request import FrameRequest
from dermis.frame.technique import TechniqueTraits
from dermis.gpu import Device
from dermis.gpu.memory import OutOfMemoryError, allocated_bytes, check_memory, format_bytes, probe_memory
from dermis.scene.settings import Settings

_CHART_EDGE_DISTANCE_BYTES = 4  # bytes per texel: distance to the edge of the chart
_FLOAT_TEXEL_BYTES = 16  # bytes per texel: four floats
_GEOMETRY_TEXEL_BYTES = 8 + 8 + 8  # bytes per atlas texel: surface point, stretch, reach
_PICTURE_PIXEL_BYTES = 36  # bytes per pixel
_BYTES_PER_SAMPLE = 8  # bytes per sample
_OUTPUT_CHANNEL_PIXEL_BYTES = 2 * 4  # bytes per pixel and channel of an output, its readback buffer included
_MIN_SUGGESTED_SAMPLES = 4  # samples per pixel; with fewer, edges alias
_MEMORY_BUDGET_FRACTION = 0.75  # fraction of free memory for a frame; the head and programs need the rest
_MIN_SUGGESTED_SIDE = 64  # smaller sides save nothing


def check_limits(device: Device, request: FrameRequest) -> None:
    """Raise DermisError if the sizes or the memory of a frame exceed the limits of the device."""
    limit, name, settings = device.max_texture_size, device.adapter.name, request.settings
    sides = {
        "size": max(settings.size),
        "atlas": request.atlas_plan.side,
        "shadow_size": settings.shadow_size,
    }
    for option, side in sides.items():
        if side > limit:
            name_limit = f"at most {limit} (the limit of {name})"
            refuse(option, name_limit, f"it is {side}", "Choose a smaller one")
    needed = frame_bytes(request)
    width, height = settings.size
    sizes = f"{request.atlas_plan.side} texels and {width}x{height} pixels"
    total = needed["atlas"] + needed["size"]
    check_memory(device, total, "atlas and size", sizes, partial(suggest_settings, request))


def out_of_memory_error(
    allocation_error: OutOfMemoryError, device: Device, request: FrameRequest
) -> OutOfMemoryError:
    """Return an error that suggests settings that fit, and release the memory of the failed frame.

    allocation_error : error that the allocation raised
    """
    for raised in filter(None, (allocation_error, allocation_error.__cause__)):
        traceback.clear_frames(raised.__traceback__)
    needed = sum(frame_bytes(request).values())
    free = probe_memory(device, needed)
    budget = _MEMORY_BUDGET_FRACTION * (allocated_bytes() + free)
    if needed <= budget:  # the estimate fits, so the process holds memory that cannot be counted
        budget = _MEMORY_BUDGET_FRACTION * free
    return OutOfMemoryError(
        allocation_error.expected,
        allocation_error.actual,
        allocation_error.size,
        suggest_settings(request, budget),
    )


def suggest_settings(request: FrameRequest, budget_bytes: float) -> str:
    """Return advice on settings whose frame fits into `budget_bytes` bytes.

    In each step, the setting that needs the most memory is halved, until the frame fits.
    """
    smaller, changed = request, dict[str, str]()
    needed = frame_bytes(request)
    while sum(needed.values()) > budget_bytes:
        option = max(needed, key=lambda name: needed[name])
        halved = _halved_settings(smaller.settings, option)
        if halved is None:
            break
        smaller = replace(smaller, settings=halved)
        needed, changed = frame_bytes(smaller), changed | _command_line_options(halved, option)
    if not changed or sum(needed.values()) > budget_bytes:
        return "Close other programs that use the memory, or try --adapter cpu"
    return f"With {' '.join(changed.values())} it takes about {format_bytes(sum(needed.values()))}"


def frame_bytes(request: FrameRequest) -> dict[str, float]:
    """Return a dictionary from the name of a size setting to the memory that this setting determines [bytes].

    Memory for the head and its maps is not included.
    """
    technique, settings, atlases = request.technique, request.settings, request.atlas_plan
    width, height = settings.size
    pixel = _PICTURE_PIXEL_BYTES + _BYTES_PER_SAMPLE * settings.samples + technique.pixel_bytes
    pixel += _OUTPUT_CHANNEL_PIXEL_BYTES * sum(request.output_channels.values())
    pixel += technique.subsurface_layer_bytes * ("diffuse" in request.outputs)
    texel = atlas_texel_bytes(technique, request.blur_count, len(atlases.layouts))
    texel += _mixing_texel_bytes(request) if request.blur_count else 0.0
    if "translucent" in request.outputs:
        texel += _FLOAT_TEXEL_BYTES * (2 * len(atlases.layouts) - 1)
    return {
        "atlas": texel * atlases.side**2,
        "size": float(pixel * width * height),
        "shadow_size": float(SHADOW_TEXEL_BYTES * request.shadow_layers * settings.shadow_size**2),
    }


def _mixing_texel_bytes(request: FrameRequest) -> float:
    """Return the additional memory per atlas texel for blending several profiles [bytes]."""
    others = len(request.other_profiles)
    maps = len(request.atlas_plan.layouts) + layer_count_of_sums(others)
    return (
        others * request.technique.texel_bytes(request.blur_count) + _FLOAT_TEXEL_BYTES * maps
        if others
        else 0.0
    )


def _halved_settings(settings: Settings, option_name: str) -> Settings | None:
    """Return settings with half the value of a size setting, None if this value would be too small.

    For "size", the number of samples per pixel is halved instead while it exceeds a minimum.
    """
    if option_name == "size" and settings.samples > _MIN_SUGGESTED_SAMPLES:
        return settings.model_copy(update={"samples": settings.samples // 2})
    value: Any = getattr(settings, option_name)
    half: Any = tuple(side // 2 for side in value) if option_name == "size" else value // 2
    return settings.model_copy(update={option_name: half}) if np.min(half) >= _MIN_SUGGESTED_SIDE else None


def _command_line_options(settings: Settings, option_name: str) -> dict[str, str]:
    """Return the command line options that set a size setting, as {name of the setting: options}."""
    if option_name != "size":
        return {option_name: f"--{option_name.replace('_', '-')} {getattr(settings, option_name)}"}
    width, height = settings.size
    return {"size": f"--size {width}x{height} --samples {settings.samples}"}


def atlas_texel_bytes(technique: TechniqueTraits, blur_count: int, layout_count: int) -> float:
    """Return the memory per atlas texel on a software adapter [bytes].

    It covers geometry, blur pyramid, temporary textures of light, and the weighted sum of the blurred levels.

    blur_count : number of Gaussians that blur light
    layout_count : number of atlas layouts
    """
    if not blur_count:
        return layout_count * _GEOMETRY_TEXEL_BYTES
    blurs = technique.texel_bytes(blur_count)
    blended = _FLOAT_TEXEL_BYTES + layout_count * _CHART_EDGE_DISTANCE_BYTES if layout_count > 1 else 0
    return blurs + blended + layout_count * (_GEOMETRY_TEXEL_BYTES + SURFACE_TEXEL_BYTES + _FLOAT_TEXEL_BYTES)
