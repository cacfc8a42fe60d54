"""Space on the device for hairs: in pictures and shadows, and where they are worked out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from dermis.gpu import Device, make_texture
from dermis.mesh.head import Head
from dermis.mesh.strands import Strands

TILE = 8
"""Pixels along a side of the tiles that hairs are listed in."""
_WAYS = 64  # chains of a tile on GPUs: one for each pixel's invocation to follow
WINDOW = 256  # texels across what hairs hold back of a light, half as many down
LAYERS = 6  # of depth there
HEAD_WORDS = 8  # before them
_LINKS_OF_PIECE = 4  # for hairs in no more than a few tiles
_MOST_LINKS = 1 << 22
_FINE_STEP, _KNOT_STEP = 1 << 12, 1 << 19  # that room is made for, so that most people have room in the same


class Counts(NamedTuple):
    """How many hairs, and how many knots each has."""

    hairs: int
    knots: int

    def pieces(self, hairs: int | None = None) -> int:
        """Between the knots of all or of some."""
        return (self.hairs if hairs is None else hairs) * (self.knots - 1)


class Room(NamedTuple):
    """How many hairs and knots there is room for.

    fine : hairs of brows and lashes
    knots : of all
    """

    fine: int
    knots: int


@dataclass(frozen=True, eq=False)
class StrandSpace:
    """What hairs of a frame are worked out in: knots in space, and in the picture."""

    posed: Any
    drawn: Any


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


def counts_of(strands: Strands | None) -> Counts:
    """Of hairs, or of none."""
    return Counts(0, 2) if strands is None else Counts(*strands.radius_mm.shape)


def room_of(head: Head) -> Room:
    """Room for the hairs of a head, and for those of most others."""
    fine, coarse = map(counts_of, (head.strands, head.hair))
    knots = fine.hairs * fine.knots + coarse.hairs * coarse.knots
    return Room(_next(fine.hairs, _FINE_STEP), _next(knots, _KNOT_STEP if coarse.hairs else _FINE_STEP))


def _next(count: int, step: int) -> int:
    return -(-count // step) * step


def make_space(device: Device, room: Room) -> StrandSpace:
    """Space for hairs in it."""
    hairs = room.knots // 2  # at most
    return StrandSpace(_space(device, 4 * (room.knots + 2 * hairs)), _space(device, 8 * room.knots))


def make_strand_picture(device: Device, room: Room, size: tuple[int, int]) -> StrandPicture:
    """Space for hairs in a picture of size (width, height), where each may cross all of it."""
    across, down = (-(-side // TILE) for side in size)
    links = _LINKS_OF_PIECE * room.knots + room.fine * (across + down)
    links = min(links, _MOST_LINKS, device.max_storage_bytes // 8)
    ways = ways_of(device, across * down)
    chains = _space(device, 1 + ways * across * down)
    return StrandPicture(chains, _space(device, 2 * links), make_texture(device, size, "rgba32float"), ways)


def ways_of(device: Device, tiles: int) -> int:
    """Chains of a tile: as many as pixels, but on software adapters and for pictures of too many tiles."""
    fits = 4 * (1 + _WAYS * tiles) <= device.max_storage_bytes
    return _WAYS if fits and device.adapter.kind != "CPU" else 1


def make_strand_shadows(device: Device, layers: int) -> Any:
    """Space for what hairs hold back of so many lights."""
    return _space(device, (HEAD_WORDS + (1 + LAYERS) * WINDOW**2 // 2) * max(1, layers))


def no_strand_shadows(device: Device) -> Any:
    """Placeholder where there are no hairs."""
    return device.shared("no strand shadows", lambda: _space(device, HEAD_WORDS))


def _space(device: Device, words: int) -> Any:
    return device.space(4 * words)
