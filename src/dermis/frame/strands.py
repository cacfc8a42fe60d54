"""Hairs on the device: where they are rooted, where they are, and space for drawing them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dermis.errors import refuse
from dermis.frame.surface import DEFAULT_COLOUR
from dermis.gpu import Constants, Device, make_texture
from dermis.mesh.head import Head
from dermis.mesh.strands import corners, weights
from dermis.scene.settings import Settings
from dermis.specular.hair import hair_numbers

_TILE = 8  # pixels along a side of the tiles that hairs are listed in
_WAYS = 64  # chains of a tile on GPUs: one for each pixel's invocation to follow
_WINDOW = 256  # texels across what hairs hold back of a light, half as many down
_HEAD_WORDS = 8  # before them
_LINKS_OF_PIECE = 4  # for hairs in no more than a few tiles
_STRAND = np.dtype([("corner", "u4", 4), ("share", "f4", 4), ("absorption", "f4", 4)])  # in strands_pose.wgsl


@dataclass(frozen=True, eq=False)
class StrandTables:
    """What hairs are, in buffers.

    strands, knots : by hair and by knot, as strands_pose.wgsl reads them
    posed, drawn : knots in space and in the picture
    hairs, pieces : counts
    constants : pipeline constants of the shaders that read knots
    """

    strands: Any
    knots: Any
    posed: Any
    drawn: Any
    hairs: int
    pieces: int
    constants: Constants


@dataclass(frozen=True, eq=False)
class StrandPicture:
    """Space for hairs in a picture.

    chains, links : pieces of hair tile by tile, see strands_bin.wgsl
    result : the picture with hairs
    ways : chains of a tile
    """

    chains: Any
    links: Any
    result: Any
    ways: int


@dataclass(frozen=True, eq=False)
class StrandResources:
    """What the passes of hairs read and write.

    shadows : buffer of what they hold back of each light
    skin : (3,) albedo of the skin under them
    """

    tables: StrandTables
    picture: StrandPicture
    shadows: Any
    skin: tuple[float, ...]


def strand_numbers() -> dict[str, float]:
    """Numbers that the shaders of hairs fill in."""
    window = {"strand_window": _WINDOW, "strand_window_words": _HEAD_WORDS}
    return {"strand_tile": _TILE, **window, **hair_numbers()}


def has_strands(head: Head, settings: Settings) -> bool:
    """Whether hairs are drawn."""
    return settings.strands and head.strands is not None and len(head.strands) > 0


def strand_constants(head: Head, settings: Settings) -> Constants:
    """Pipeline constants of what is lit, for the shadows of hairs."""
    return (("STRANDS", 1),) if has_strands(head, settings) else ()


def make_tables(device: Device, head: Head) -> StrandTables:
    """The hairs of a head.

    Raises DermisError for hairs of another mesh.
    """
    strands = head.strands
    assert strands is not None
    if int(strands.roots.quad.max()) >= len(head.mesh.quads):
        came = f"its mesh has {len(head.mesh.quads)} quads"
        refuse(head.name, "hairs rooted in quads of its mesh", came, "Leave its strands out")
    count, knots = strands.radius_mm.shape
    table = np.zeros(count, _STRAND)
    table["corner"] = corners(head.mesh, strands.roots.quad)
    table["share"] = weights(strands.roots.place)
    table["absorption"][:, :3] = strands.absorption
    rows = np.concatenate([strands.knots_mm, strands.radius_mm[..., None]], axis=-1).astype(np.float32)
    return StrandTables(
        strands=device.buffer(table.view(np.uint32), "STORAGE"),
        knots=device.buffer(rows.reshape(-1, 4), "STORAGE"),
        posed=_words(device, 4 * count * (knots + 2)),
        drawn=_words(device, 8 * count * knots),
        hairs=count,
        pieces=count * (knots - 1),
        constants=(("KNOTS", knots),),
    )


def skin_under(head: Head) -> tuple[float, ...]:
    """(3,) albedo of the skin that hairs see below them."""
    colour = head.maps.mean_colour
    return (DEFAULT_COLOUR,) * 3 if colour is None else tuple(colour.tolist())


def make_strand_picture(device: Device, tables: StrandTables, size: tuple[int, int]) -> StrandPicture:
    """Space for hairs in a picture of size (width, height), where each may cross all of it."""
    across, down = (-(-side // _TILE) for side in size)
    links = _LINKS_OF_PIECE * tables.pieces + tables.hairs * (across + down)
    links = min(links, device.max_storage_bytes // 8)
    ways = ways_of(device, across * down)
    chains = _words(device, 1 + ways * across * down)
    return StrandPicture(chains, _words(device, 2 * links), make_texture(device, size, "rgba32float"), ways)


def ways_of(device: Device, tiles: int) -> int:
    """Chains of a tile: as many as pixels, but on software adapters and for pictures of too many tiles."""
    fits = 4 * (1 + _WAYS * tiles) <= device.max_storage_bytes
    return _WAYS if fits and device.adapter.kind != "CPU" else 1


def make_strand_shadows(device: Device, layers: int) -> Any:
    """Space for what hairs hold back of so many lights."""
    return _words(device, (_HEAD_WORDS + _WINDOW * _WINDOW) * max(1, layers))


def no_strand_shadows(device: Device) -> Any:
    """Placeholder where there are no hairs."""
    return device.shared("no strand shadows", lambda: _words(device, _HEAD_WORDS))


def _words(device: Device, count: int) -> Any:
    return device.buffer(np.zeros(count, np.uint32), "STORAGE")
