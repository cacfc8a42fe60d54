"""Hairs on the device: where they are rooted, where they are, and space for drawing them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.frame.surface import DEFAULT_COLOUR
from dermis.gpu import Constants, Device, make_texture
from dermis.mesh.head import Head
from dermis.mesh.strands import Strands, corners, weights
from dermis.scene.settings import Settings
from dermis.specular.hair import hair_numbers

TILE = 8
"""Pixels along a side of the tiles that hairs are listed in."""
_WAYS = 64  # chains of a tile on GPUs: one for each pixel's invocation to follow
_FINE_WINDOW, _WINDOW = 256, 288  # texels across what hairs hold back of a light, half as many down
_LAYERS = 6  # of depth there
_HEAD_WORDS = 8  # before them
_LINKS_OF_PIECE = 4  # for hairs in no more than a few tiles
_MOST_LINKS = 1 << 22
_SHADING = 32_000  # coarse hairs that shade as all do
_LEAST_DRAWN = 5_000
_DRAWN_PIXELS = 0.45  # width of the coarse hairs that are drawn
_DENSER = 0.2  # and more of it where hair hides hair
_STRAND = np.dtype([("corner", "u4", 4), ("share", "f4", 4), ("absorption", "f4", 4)])  # in strands_pose.wgsl
_HAIRS = np.dtype(
    [("fine", "u4"), ("coarse", "u4"), ("shading", "u4"), ("wider", "f4")]
)  # in strand_knots.wgsl


class Counts(NamedTuple):
    """How many hairs, and how many knots each has."""

    hairs: int
    knots: int

    def pieces(self, hairs: int | None = None) -> int:
        """Between the knots of all or of some."""
        return (self.hairs if hairs is None else hairs) * (self.knots - 1)


@dataclass(frozen=True, eq=False)
class StrandTables:
    """What hairs are, in buffers.

    strands, knots : by hair and by knot, as strands_pose.wgsl reads them
    posed, drawn : knots in space and in the picture
    record : Hairs of strand_knots.wgsl
    fine, coarse : of brows and lashes, and of head and beard
    shading : coarse hairs that shade
    middle_mm : of the coarse hairs at rest (3,) [mm]
    wide_mm : they are on average [mm]
    cover : of their roots by hair, on average [-]
    constants, window : pipeline constants of the shaders that read knots, and what hairs hold back
    """

    strands: Any
    knots: Any
    posed: Any
    drawn: Any
    record: Any
    fine: Counts
    coarse: Counts
    shading: int
    middle_mm: NDArray[np.float64]
    wide_mm: float
    cover: float
    constants: Constants
    window: Constants


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
    window = {"strand_layers": _LAYERS, "strand_window_words": _HEAD_WORDS}
    return {"strand_tile": TILE, **window, **hair_numbers()}


def has_strands(head: Head, settings: Settings) -> bool:
    """Whether hairs are drawn."""
    return settings.strands and any(part is not None and len(part) > 0 for part in (head.strands, head.hair))


def strand_constants(head: Head, settings: Settings) -> Constants:
    """Pipeline constants of what is lit, for the shadows of hairs."""
    if not has_strands(head, settings):
        return ()
    return (("STRANDS", 1), ("STRAND_WINDOW", window_of(0 if head.hair is None else len(head.hair))))


def window_of(coarse: int) -> int:
    """Texels across what hairs hold back of a light: brows and lashes alone take a small part of the head."""
    return _WINDOW if coarse else _FINE_WINDOW


def drawn_of(tables: StrandTables, pixel_mm: float) -> int:
    """How many of the coarse hairs stand for all, as wide as a pixel of this size."""
    everything = tables.coarse.hairs * tables.wide_mm
    wide = (_DRAWN_PIXELS + _DENSER * tables.cover) * pixel_mm
    return int(min(tables.coarse.hairs, max(_LEAST_DRAWN, everything / wide)))


def make_tables(device: Device, head: Head) -> StrandTables:
    """The hairs of a head.

    Raises DermisError for hairs of another mesh.
    """
    both = head.strands, head.hair
    parts = [part for part in both if part is not None]
    fine, coarse = (Counts(0, 2) if part is None else Counts(*part.radius_mm.shape) for part in both)
    table = np.concatenate([_rows(head, part) for part in parts])
    rows = [np.concatenate([part.knots_mm, part.radius_mm[..., None]], axis=-1) for part in parts]
    knots = np.concatenate([one.astype(np.float32).reshape(-1, 4) for one in rows])
    shading = min(coarse.hairs, _SHADING)
    record = np.array((fine.hairs, coarse.hairs, shading, coarse.hairs / max(1, shading)), _HAIRS)
    return StrandTables(
        strands=device.buffer(table.view(np.uint32), "STORAGE"),
        knots=device.buffer(knots, "STORAGE"),
        posed=_words(device, 4 * (len(knots) + 2 * len(table))),
        drawn=_words(device, 8 * len(knots)),
        record=record,
        fine=fine,
        coarse=coarse,
        shading=shading,
        middle_mm=np.zeros(3) if head.hair is None else head.hair.middle_mm(head.mesh),
        wide_mm=0.0 if head.hair is None else 2.0 * float(head.hair.radius_mm[:, 0].mean()),
        cover=0.0 if head.hair is None or head.hair.cover is None else float(head.hair.cover.mean()),
        constants=(("KNOTS", fine.knots), ("COARSE_KNOTS", coarse.knots)),
        window=(("STRAND_WINDOW", window_of(coarse.hairs)),),
    )


def _rows(head: Head, strands: Strands) -> NDArray[Any]:
    """What strands_pose.wgsl reads of each hair."""
    if int(strands.roots.quad.max()) >= len(head.mesh.quads):
        came = f"its mesh has {len(head.mesh.quads)} quads"
        refuse(head.name, "hairs rooted in quads of its mesh", came, "Leave its strands out")
    table = np.zeros(len(strands), _STRAND)
    table["corner"] = corners(head.mesh, strands.roots.quad)
    table["share"] = weights(strands.roots.place)
    table["absorption"][:, :3] = strands.absorption
    if strands.cover is not None:
        table["absorption"][:, 3] = strands.cover
    return table


def skin_under(head: Head) -> tuple[float, ...]:
    """(3,) albedo of the skin that hairs see below them."""
    colour = head.maps.mean_colour
    return (DEFAULT_COLOUR,) * 3 if colour is None else tuple(colour.tolist())


def make_strand_picture(device: Device, tables: StrandTables, size: tuple[int, int]) -> StrandPicture:
    """Space for hairs in a picture of size (width, height), where each may cross all of it."""
    across, down = (-(-side // TILE) for side in size)
    pieces = tables.fine.pieces() + tables.coarse.pieces()
    links = _LINKS_OF_PIECE * pieces + tables.fine.hairs * (across + down)
    links = min(links, _MOST_LINKS, device.max_storage_bytes // 8)
    ways = ways_of(device, across * down)
    chains = _words(device, 1 + ways * across * down)
    return StrandPicture(chains, _words(device, 2 * links), make_texture(device, size, "rgba32float"), ways)


def ways_of(device: Device, tiles: int) -> int:
    """Chains of a tile: as many as pixels, but on software adapters and for pictures of too many tiles."""
    fits = 4 * (1 + _WAYS * tiles) <= device.max_storage_bytes
    return _WAYS if fits and device.adapter.kind != "CPU" else 1


def make_strand_shadows(device: Device, layers: int, tables: StrandTables) -> Any:
    """Space for what hairs hold back of so many lights."""
    texels = window_of(tables.coarse.hairs) ** 2 // 2
    return _words(device, (_HEAD_WORDS + (1 + _LAYERS) * texels) * max(1, layers))


def no_strand_shadows(device: Device) -> Any:
    """Placeholder where there are no hairs."""
    return device.shared("no strand shadows", lambda: _words(device, _HEAD_WORDS))


def _words(device: Device, count: int) -> Any:
    return device.buffer(np.zeros(count, np.uint32), "STORAGE")
