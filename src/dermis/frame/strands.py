"""Hairs on the device: where they are rooted, where they are, and space for drawing them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.frame.strand_space import (
    HEAD_WORDS,
    LAYERS,
    TILE,
    WINDOW,
    Counts,
    StrandPicture,
    StrandSpace,
    counts_of,
)
from dermis.frame.surface import DEFAULT_COLOUR
from dermis.gpu import Constants, Device
from dermis.mesh.head import Head
from dermis.mesh.strands import Strands, corners, weights
from dermis.scene.settings import Settings
from dermis.specular.hair import hair_numbers

_SHADING = 32_000  # coarse hairs that shade as all do
_LEAST_DRAWN = 5_000
_DRAWN_PIXELS = 0.45  # width of the coarse hairs that are drawn
_DENSER = 0.2  # and more of it where hair hides hair
WINDOW_KNOTS = 1 << 12  # that a workgroup finds the ends of
_STRAND = np.dtype([("corner", "u4", 4), ("share", "f4", 4), ("absorption", "f4", 4)])  # in strands_pose.wgsl
_COUNTS = "fine", "coarse", "shading", "fine_knots", "coarse_knots"
_HAIRS = np.dtype([*((name, "u4") for name in _COUNTS), ("wider", "f4")])  # in strand_knots.wgsl


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


def _tell(rows: NDArray[Any], head: Head, strands: Strands) -> None:
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
