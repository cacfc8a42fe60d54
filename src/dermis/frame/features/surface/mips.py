"""Maps of the head with all their mips, filled in by the device."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.frame.programs import HALVES, program
from dermis.gpu import (
    Bindings,
    Buffer,
    CommandList,
    Device,
    Recorder,
    Texture,
    TextureView,
    make_texture,
    upload,
)
from dermis.gpu.textures import texture_from, view_of
from dermis.images.filters import mip_chain

Floats = NDArray[np.float32]
_ROWS = 32  # of an invocation, as in relief.wgsl
_BAND_BYTES = 96 << 20  # of heights at a time: every device can bind so many


class Mipped(NamedTuple):
    """A texture, and views of its mips to read from and to store to."""

    texture: Texture
    levels: tuple[TextureView, ...]

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [texels]."""
        width, height = self.texture.size[:2]
        return width, height


def colours(device: Device, image: Floats) -> Texture:
    """A texture of an (h, w, 3) picture."""
    made = empty(device, image.shape)
    upload(device, made.texture, np.dstack([image.astype(np.float16), np.ones(image.shape[:2], np.float16)]))
    frame = CommandList(device, timed=False)
    halve(frame, made)
    frame.submit()
    return made.texture


def slopes(device: Device, image: Floats | None) -> Texture:
    """A texture of (h, w, 2) slopes and their squares; flat without any."""
    if image is None:
        return _flat(device)
    made, frame = empty(device, image.shape), CommandList(device, timed=False)
    bound: Bindings = {"slopes": texture_from(device, image, "rg32float"), "stored": made.levels[0]}
    shader = program(device, "surface/map_moments.wgsl", store=HALVES)
    frame.compute("maps", shader, bound, image.shape[1::-1])
    halve(frame, made)
    frame.submit()
    return made.texture


def detail(device: Device, slopes: Floats) -> Texture:
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


def relief(device: Device, height: Floats | None) -> Texture:
    """A texture of the slopes of an (h, w) height map [mm per texel] and their squares; flat without any.

    Beyond the edge a plane goes on.
    """
    if height is None or height.size == 1:
        return _flat(device)
    padded = np.pad(height, 1, "reflect", reflect_type="odd")
    band = max(_BAND_BYTES // padded[:1].nbytes // _ROWS, 1) * _ROWS
    bands = (device.buffer(padded[top : top + band + 2], "STORAGE") for top in range(0, len(height), band))
    return relief_of(device, bands, height.shape, band)


def relief_of(device: Device, bands: Iterable[Buffer], shape: tuple[int, ...], band: int) -> Texture:
    """The same of heights in buffers, of so many rows each, with a texel more on all sides."""
    made, frame, (rows, columns) = empty(device, shape), CommandList(device, timed=False), shape
    for index, heights in enumerate(bands):
        _relieve(frame, made, heights, index * band, min(band, rows - index * band))
    halve(frame, made, 1 if rows % 2 or columns % 2 else 2)
    frame.submit()
    return made.texture


def relieve(recorder: Recorder, relief: Mipped, heights: Buffer) -> None:
    """Fill a texture of even sides, and its mips, with the slopes of heights in one buffer."""
    _relieve(recorder, relief, heights, 0, relief.size[1])
    halve(recorder, relief, 2)


def _relieve(recorder: Recorder, relief: Mipped, heights: Buffer, top: int, rows: int) -> None:
    device = recorder.device
    first = device.shared(
        f"relief from row {top}", lambda: device.buffer(np.array([top], np.uint32), "STORAGE")
    )
    bound: Bindings = {
        "top": first,
        "heights": heights,
        "stored": relief.levels[0],
        "halved": relief.levels[1],
    }
    size = -(-relief.size[0] // 2), -(-rows // _ROWS)
    recorder.compute("maps", program(device, "surface/relief.wgsl", store=HALVES), bound, size)


def _flat(device: Device) -> Texture:
    return device.shared("no relief", lambda: make_texture(device, (1, 1), HALVES, use="map"))


def empty(device: Device, shape: tuple[int, ...]) -> Mipped:
    """Space for an (h, w) map with all its mips."""
    mips = max(shape[:2]).bit_length()
    texture = make_texture(device, (shape[1], shape[0]), HALVES, mips=mips, name="painted map")
    return mipped(texture)


def mipped(texture: Texture) -> Mipped:
    """A texture with views of its mips."""
    return Mipped(texture, tuple(view_of(texture, mip=mip) for mip in range(texture.mip_level_count)))


def halve(recorder: Recorder, mipped: Mipped, first: int = 1) -> None:
    """Fill the mips of a texture from the first one that is not there."""
    shader, levels = program(recorder.device, "surface/map_halve.wgsl", store=HALVES), mipped.levels
    width, height = mipped.size
    for mip in range(first, len(levels)):
        bound: Bindings = {"finer": levels[mip - 1], "stored": levels[mip]}
        recorder.compute("maps", shader, bound, (max(width >> mip, 1), max(height >> mip, 1)))
