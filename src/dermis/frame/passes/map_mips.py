"""Maps of the head with all their mips, filled in by the device."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.frame.levels import HALVES
from dermis.frame.passes import program
from dermis.gpu import Device, Frame, make_texture, upload
from dermis.gpu.textures import texture_from
from dermis.images.filters import mip_chain

Floats = NDArray[np.float32]
_ROWS = 32  # of an invocation, as in relief.wgsl
_BAND_BYTES = 96 << 20  # of heights at a time: every device can bind so many


def colours(device: Device, image: Floats) -> Any:
    """A texture of an (h, w, 3) picture."""
    texture = empty(device, image.shape)
    upload(device, texture, np.dstack([image.astype(np.float16), np.ones(image.shape[:2], np.float16)]))
    frame = Frame(device, timed=False)
    halve(frame, texture)
    frame.submit()
    return texture


def slopes(device: Device, image: Floats | None) -> Any:
    """A texture of (h, w, 2) slopes and their squares; flat without any."""
    if image is None:
        return _flat(device)
    texture, frame = empty(device, image.shape), Frame(device, timed=False)
    bound = {"slopes": texture_from(device, image, "rg32float"), "stored": finest(texture)}
    shader = program(device, "map_moments.wgsl", store=HALVES)
    frame.compute("maps", shader, bound, image.shape[1::-1])
    halve(frame, texture)
    frame.submit()
    return texture


def detail(device: Device, slopes: Floats) -> Any:
    """A texture of two layers: a tile's (h, w, 4) slopes of two kinds, and the squares of either's."""
    squares = slopes * slopes
    sums = np.stack([squares[..., 0] + squares[..., 1], squares[..., 2] + squares[..., 3]], axis=-1)
    layers = slopes, np.pad(sums, ((0, 0), (0, 0), (0, 2)))
    height, width = slopes.shape[:2]
    mips = max(height, width).bit_length()
    texture = make_texture(device, (width, height), HALVES, layers=len(layers), mips=mips, use="map")
    for layer, texels in enumerate(layers):
        for mip, level in enumerate(mip_chain(texels)):
            upload(device, texture, level, mip=mip, layer=layer)
    return texture


def relief(device: Device, height: Floats | None) -> Any:
    """A texture of the slopes of an (h, w) height map [mm per texel] and their squares; flat without any.

    Beyond the edge a plane goes on.
    """
    if height is None or height.size == 1:
        return _flat(device)
    padded = np.pad(height, 1, "reflect", reflect_type="odd")
    band = max(_BAND_BYTES // padded[:1].nbytes // _ROWS, 1) * _ROWS
    bands = (device.buffer(padded[top : top + band + 2], "STORAGE") for top in range(0, len(height), band))
    return relief_of(device, bands, height.shape, band)


def relief_of(device: Device, bands: Iterable[Any], shape: tuple[int, ...], band: int) -> Any:
    """The same of heights in buffers, of so many rows each, with a texel more on all sides."""
    texture, frame = empty(device, shape), Frame(device, timed=False)
    shader, (rows, columns) = program(device, "relief.wgsl", store=HALVES), shape
    for index, heights in enumerate(bands):
        top = index * band
        bound = {"top": device.buffer(np.array([top], np.uint32), "STORAGE"), "heights": heights}
        bound |= {"stored": finest(texture), "halved": _level(texture, 1)}
        size = -(-columns // 2), -(-min(band, rows - top) // _ROWS)
        frame.compute("maps", shader, bound, size)
    halve(frame, texture, 1 if rows % 2 or columns % 2 else 2)
    frame.submit()
    return texture


def _flat(device: Device) -> Any:
    return device.shared("no relief", lambda: make_texture(device, (1, 1), HALVES, use="map"))


def empty(device: Device, shape: tuple[int, ...]) -> Any:
    """Space for an (h, w) map with all its mips."""
    return make_texture(device, (shape[1], shape[0]), HALVES, mips=max(shape[:2]).bit_length())


def halve(frame: Frame, texture: Any, first: int = 1) -> None:
    """Fill the mips of a texture from the first one that is not there."""
    shader = program(frame.device, "map_halve.wgsl", store=HALVES)
    width, height = texture.size[:2]
    for mip in range(first, texture.mip_level_count):
        bound = {"finer": _level(texture, mip - 1), "stored": _level(texture, mip)}
        frame.compute("maps", shader, bound, (max(width >> mip, 1), max(height >> mip, 1)))


def finest(texture: Any) -> Any:
    """The first level of a texture, to store to."""
    return _level(texture, 0)


def _level(texture: Any, mip: int) -> Any:
    return texture.create_view(dimension="2d", base_mip_level=mip, mip_level_count=1)
