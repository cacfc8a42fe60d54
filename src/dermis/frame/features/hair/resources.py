"""Resources of hair: tables of strands, and space for the picture and for shadows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.features.surface.record import DEFAULT_COLOUR
from dermis.frame.request import FrameRequest
from dermis.gpu import Buffer, Constants, Device, Memo, Record, Texture, make_texture
from dermis.mesh.head import Head
from dermis.mesh.strands import Strands, corners, weights
from dermis.scene.settings import Settings
from dermis.specular.hair import hair_numbers

TILE = 8
"""Pixels along a side of the tiles that hairs are listed in."""
_WAYS = 64  # chains of a tile on GPUs: one for each pixel's invocation to follow
WINDOW = 256  # texels across what hairs hold back of a light, half as many down
LAYERS = 6  # of depth there
HEAD_WORDS = 8  # before them
_LINKS_OF_PIECE = 4  # for hairs in no more than a few tiles
_MOST_LINKS = 1 << 22
_FINE_STEP, _KNOT_STEP = 1 << 12, 1 << 19  # that room is made for, so that most people have room in the same
_SHADING = 32_000  # coarse hairs that shade as all do
_LEAST_DRAWN = 5_000
_DRAWN_PIXELS = 0.45  # width of the coarse hairs that are drawn
_DENSER = 0.2  # and more of it where hair hides hair
WINDOW_KNOTS = 1 << 12  # that a workgroup finds the ends of
_STRAND = np.dtype([("corner", "u4", 4), ("share", "f4", 4), ("absorption", "f4", 4)])  # in strands_pose.wgsl
_COUNTS = "fine", "coarse", "shading", "fine_knots", "coarse_knots"
_HAIRS = np.dtype([*((name, "u4") for name in _COUNTS), ("wider", "f4")])  # in strand_knots.wgsl


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

    posed: Buffer
    drawn: Buffer


@dataclass(frozen=True, eq=False)
class StrandPicture:
    """Space for hairs in a picture.

    chains, links : pieces of hair tile by tile, see strands_bin.wgsl
    result : the picture with hairs
    ways : chains of a tile
    """

    chains: Buffer
    links: Buffer
    result: Texture
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


def make_strand_shadows(device: Device, layers: int) -> Buffer:
    """Space for what hairs hold back of so many lights."""
    return _space(device, (HEAD_WORDS + (1 + LAYERS) * WINDOW**2 // 2) * max(1, layers))


def no_strand_shadows(device: Device) -> Buffer:
    """Placeholder where there are no hairs."""
    return device.shared("no strand shadows", lambda: _space(device, HEAD_WORDS))


def _space(device: Device, words: int) -> Buffer:
    return device.space(4 * words)


@dataclass(frozen=True, eq=False)
class StrandTables:
    """What hairs are, in buffers.

    strands, knots : by hair and by knot, as strands_pose.wgsl reads them
    posed, drawn : see `StrandSpace`
    record : Hairs of strand_knots.wgsl
    fine, coarse : of brows and lashes, and of head and beard
    shading : coarse hairs that shade
    middle_mm : of the coarse hairs at rest (3,) [mm]
    wide_mm : they are on average [mm]
    cover : of their roots by hair, on average [-]
    """

    strands: Buffer
    knots: Buffer
    posed: Buffer
    drawn: Buffer
    record: Record
    fine: Counts
    coarse: Counts
    shading: int
    middle_mm: NDArray[np.float64]
    wide_mm: float
    cover: float


@dataclass(frozen=True, eq=False)
class Resources:
    """What the passes of hairs read and write.

    shadows : buffer of what they hold back of each light
    skin : (3,) albedo of the skin under them
    """

    tables: StrandTables
    picture: StrandPicture
    shadows: Buffer
    skin: tuple[float, ...]


def strand_numbers() -> dict[str, float]:
    """Numbers that the shaders of hairs fill in."""
    window = {"strand_window": WINDOW, "strand_layers": LAYERS, "strand_window_words": HEAD_WORDS}
    window |= {"strand_window_knots": WINDOW_KNOTS}
    return {"strand_tile": TILE, **window, **hair_numbers()}


def has_strands(head: Head, settings: Settings) -> bool:
    """Whether hairs are drawn."""
    return settings.strands and any(part is not None and len(part) > 0 for part in (head.strands, head.hair))


def strand_constants(head: Head, settings: Settings) -> Constants:
    """Pipeline constants of what is lit, for the shadows of hairs."""
    return (("STRANDS", 1),) if has_strands(head, settings) else ()


def drawn_of(tables: StrandTables, pixel_mm: float) -> int:
    """How many of the coarse hairs stand for all, as wide as a pixel of this size."""
    everything = tables.coarse.hairs * tables.wide_mm
    wide = (_DRAWN_PIXELS + _DENSER * tables.cover) * pixel_mm
    return int(min(tables.coarse.hairs, max(_LEAST_DRAWN, everything / wide)))


def make_tables(device: Device, head: Head, space: StrandSpace) -> StrandTables:
    """The hairs of a head.

    Raises DermisError for hairs of another mesh.
    """
    both = head.strands, head.hair
    parts = [part for part in both if part is not None]
    fine, coarse = map(counts_of, both)
    table = np.zeros(fine.hairs + coarse.hairs, _STRAND)
    for part, first in zip(parts, (0, len(parts[0])), strict=False):
        _tell(table[first : first + len(part)], head, part)
    knots = np.concatenate([_knots(part) for part in parts])
    shading = min(coarse.hairs, _SHADING)
    wider = coarse.hairs / max(1, shading)
    record = np.array((fine.hairs, coarse.hairs, shading, fine.knots, coarse.knots, wider), _HAIRS)
    return StrandTables(
        strands=device.buffer(table.view(np.uint32), "STORAGE"),
        knots=device.buffer(knots, "STORAGE"),
        posed=space.posed,
        drawn=space.drawn,
        record=record,
        fine=fine,
        coarse=coarse,
        shading=shading,
        middle_mm=np.zeros(3) if head.hair is None else head.hair.middle_mm(head.mesh),
        wide_mm=0.0 if head.hair is None else 2.0 * float(head.hair.radius_mm[:, 0].mean()),
        cover=0.0 if head.hair is None or head.hair.cover is None else float(head.hair.cover.mean()),
    )


def _tell(rows: NDArray[np.void], head: Head, strands: Strands) -> None:
    """Fill in what strands_pose.wgsl reads of each hair."""
    if int(strands.roots.quad.max()) >= len(head.mesh.quads):
        came = f"its mesh has {len(head.mesh.quads)} quads"
        refuse(head.name, "hairs rooted in quads of its mesh", came, "Leave its strands out")
    rows["corner"] = corners(head.mesh, strands.roots.quad)
    rows["share"] = weights(strands.roots.place)
    rows["absorption"][:, :3] = strands.absorption
    if strands.cover is not None:
        rows["absorption"][:, 3] = strands.cover


def _knots(strands: Strands) -> NDArray[np.float32]:
    """(n k, 4) knots with their radius [mm]."""
    found = np.empty((*strands.radius_mm.shape, 4), np.float32)
    found[..., :3], found[..., 3] = strands.knots_mm, strands.radius_mm
    return found.reshape(-1, 4)


def skin_under(head: Head) -> tuple[float, ...]:
    """(3,) albedo of the skin that hairs see below them."""
    colour = head.maps.mean_colour
    return (DEFAULT_COLOUR,) * 3 if colour is None else tuple(colour.tolist())


def make(memo: Memo, device: Device, request: FrameRequest) -> Resources | None:
    """Return the resources of the requested head's hair, None without hair.

    Raises DermisError for hairs of another mesh.
    """
    head, keep, layers = request.head, memo.keep, request.shadow_layers
    if not has_strands(head, request.settings):
        return None
    room = room_of(head)
    tables = keep(make_tables, device, head.bare, keep(make_space, device, room))
    picture = keep(make_strand_picture, device, room, request.settings.size)
    shadows = keep(make_strand_shadows, device, layers, of=f"{layers} {request.view}")
    return Resources(tables, picture, shadows, keep(skin_under, head))
