"""Maps of the head with all their mips, filled in by the device."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.frame.levels import HALVES
from dermis.frame.passes import program
from dermis.gpu import Device, Frame, make_texture, upload
from dermis.gpu.textures import texture_from

Floats = NDArray[np.float32]
_COLUMNS, _ROWS = 2, 32  # of an invocation, as in relief.wgsl


def colours(device: Device, image: Floats) -> Any:
    """A texture of an (h, w, 3) picture."""
    texture = _empty(device, image.shape)
    upload(device, texture, np.dstack([image.astype(np.float16), np.ones(image.shape[:2], np.float16)]))
    frame = Frame(device, timed=False)
    _halve(frame, texture)
    frame.submit()
    return texture


def slopes(device: Device, image: Floats | None) -> Any:
    """A texture of (h, w, 2) slopes and their squares; flat without any."""
    if image is None:
        return _flat(device)
    given = texture_from(device, image, "rg32float")
    return _computed(device, "map_moments.wgsl", {"slopes": given}, image.shape, (1, 1))


def relief(device: Device, height: Floats | None) -> Any:
    """A texture of the slopes of an (h, w) height map [mm per texel] and their squares; flat without any."""
    if height is None:
        return _flat(device)
    given = texture_from(device, height, "r32float")
    return _computed(device, "relief.wgsl", {"height_map": given}, height.shape, (_ROWS, _COLUMNS))


def _flat(device: Device) -> Any:
    return device.shared("no relief", lambda: make_texture(device, (1, 1), HALVES, use="map"))


def _empty(device: Device, shape: tuple[int, ...]) -> Any:
    return make_texture(device, (shape[1], shape[0]), HALVES, mips=max(shape[:2]).bit_length())


def _computed(
    device: Device, name: str, given: dict[str, Any], shape: tuple[int, ...], block: tuple[int, int]
) -> Any:
    """What a shader stores, with mips.

    block : rows and columns that each invocation takes
    """
    texture, frame = _empty(device, shape), Frame(device, timed=False)
    rows, columns = (-(-side // one) for side, one in zip(shape, block, strict=False))
    bound = given | {"stored": _level(texture, 0)}
    frame.compute("maps", program(device, name, store=HALVES), bound, (columns, rows))
    _halve(frame, texture)
    frame.submit()
    return texture


def _halve(frame: Frame, texture: Any) -> None:
    """Fill the mips of a texture whose first level is there."""
    shader = program(frame.device, "map_halve.wgsl", store=HALVES)
    width, height = texture.size[:2]
    for mip in range(1, texture.mip_level_count):
        bound = {"finer": _level(texture, mip - 1), "stored": _level(texture, mip)}
        frame.compute("maps", shader, bound, (max(width >> mip, 1), max(height >> mip, 1)))


def _level(texture: Any, mip: int) -> Any:
    return texture.create_view(dimension="2d", base_mip_level=mip, mip_level_count=1)
